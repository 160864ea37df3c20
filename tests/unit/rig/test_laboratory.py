"""The commands that come from the laboratory, with it and without it."""

import importlib.metadata
import os
import sys

import pytest
from typer.testing import CliRunner

from drumstick_lab.programs import module_of, programs
from rig.cli import laboratory
from rig.cli.command import app
from rig.exit_status import GIVEN, LACKING, CommandError


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


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Programs that would have taken this process's place."""
    found: list[list[str]] = []
    monkeypatch.setattr(os, "execv", lambda _, words: found.append(words))
    return found


@pytest.mark.parametrize("asked", ["--help", "-h"])
def test_help_of_a_program_without_options_measures_nothing(started: list[list[str]], asked: str) -> None:
    done = CliRunner().invoke(app, ["lab", "accuracy", asked])
    assert done.exit_code == 0
    assert "stores lab/results/accuracy.json" in done.output
    refused = CliRunner().invoke(app, ["lab", "accuracy", "--quick"]).exception
    assert isinstance(refused, CommandError)
    assert (refused.status, "--quick" in str(refused)) == (GIVEN, True)
    assert started == []


def test_a_program_with_options_tells_its_own_help(started: list[list[str]]) -> None:
    CliRunner().invoke(app, ["lab", "held-arm", "--help"])
    CliRunner().invoke(app, ["lab", "accuracy"])
    held, plain = module_of("held-arm"), module_of("accuracy")
    assert started == [[sys.executable, "-m", held, "--help"], [sys.executable, "-m", plain]]
