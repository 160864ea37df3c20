"""The commands that come from the laboratory, with it and without it."""

import importlib.metadata

import pytest
from typer.testing import CliRunner

from drumstick_lab.programs import module_of, programs
from rig.cli import laboratory
from rig.cli.command import app
from rig.exit_status import LACKING, CommandError


@pytest.mark.parametrize("name", ["accuracy", "soak", "lab"])
def test_without_the_laboratory_a_command_says_how_to_get_it(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    none = importlib.metadata.EntryPoints()
    monkeypatch.setattr(laboratory, "entry_points", lambda **_: none)
    done = CliRunner().invoke(app, [name, "--json"])
    assert isinstance(done.exception, CommandError)
    assert done.exception.status == LACKING
    assert "pip install --no-deps -e lab" in str(done.exception)
    assert "\n" not in str(done.exception)


@pytest.mark.parametrize(("name", "option"), [("accuracy", "--quick"), ("soak", "--real-time")])
def test_with_it_the_command_tells_its_own_options(name: str, option: str) -> None:
    done = CliRunner().invoke(app, [name, "--help"])
    assert done.exit_code == 0
    assert option in done.output


def test_programs_are_listed_and_found_by_either_spelling() -> None:
    assert {"torture", "fuzz", "mutation", "held-arm", "worse", "stick-page"} <= programs().keys()
    assert module_of("held-arm") == module_of("held_arm") == "drumstick_lab.benchmarks.stick.held_arm"
    with pytest.raises(LookupError):
        module_of("commands")
