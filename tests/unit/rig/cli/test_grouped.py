"""Options that come in groups: one field of a dataclass is an option, wherever its group stands."""

from dataclasses import dataclass
from typing import Annotated, Any

import pytest
import typer
from typer.testing import CliRunner

from rig.cli.grouped import grouped
from rig.options import GatewayCliOptions, HapticOptions
from rig.supervision.plan import Options


@dataclass(frozen=True, kw_only=True)
class Lamp:
    """A lamp on the stage."""

    brightness: Annotated[float, typer.Option(help="How bright it is.")] = 0.5
    is_red: Annotated[bool, typer.Option("--red", help="In red.")] = False


def played(*words: str) -> tuple[Any, list[Any]]:
    """Options that a command with the group got."""
    app, got = typer.Typer(), []

    @grouped
    def play(*, scene: Annotated[str, typer.Option()] = "roll", lamp: Lamp, count: int = 1) -> None:
        """Play in the light of a lamp."""
        got.append((scene, lamp, count))

    app.command()(play)
    return CliRunner().invoke(app, [*words]), got


def test_a_groups_fields_are_options_with_their_words_and_defaults() -> None:
    shown, _ = played("--help")
    assert "Play in the light of a lamp." in shown.output
    for words in ("--brightness", "How bright it is.", "[default: 0.5]", "--red", "In red.", "--count"):
        assert words in shown.output
    assert "--lamp" not in shown.output
    assert played()[1] == [("roll", Lamp(), 1)]


def test_what_is_given_comes_in_the_group() -> None:
    done, got = played("--brightness", "0.9", "--red", "--scene", "tom", "--count", "3")
    assert done.exit_code == 0
    assert got == [("tom", Lamp(brightness=0.9, is_red=True), 3)]


def test_a_value_that_is_none_is_refused_by_the_options_name() -> None:
    done, got = played("--brightness", "bright")
    assert done.exit_code == 2
    assert "--brightness" in done.output
    assert not got


def test_one_option_cannot_come_twice() -> None:
    def play(lamp: Lamp, brightness: float = 1.0) -> None:
        raise AssertionError

    with pytest.raises(TypeError, match="--brightness comes twice"):
        grouped(play)


def test_a_rigs_processes_have_the_commands_own_defaults() -> None:
    haptic = HapticOptions()
    for name in ("device", "pose_is_held", "prefix", "fresh", "midi_note", "midi_channel"):
        assert getattr(Options, name) == getattr(haptic, name)
    assert GatewayCliOptions().osc_in is None, "what the rig file may say is not given"
