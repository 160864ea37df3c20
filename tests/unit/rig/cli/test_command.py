"""Words of the command line before it does anything."""

import os
import subprocess
import sys
from importlib.metadata import version

import pytest
from typer.testing import CliRunner

from rig import scene_file
from rig.cli.command import app
from rig.exit_status import CommandError


@pytest.mark.parametrize("words", [("-h",), ("scene", "-h"), ("up", "-h")], ids=" ".join)
def test_the_short_form_of_help(words: tuple[str, ...]) -> None:
    done = CliRunner().invoke(app, [*words])
    assert done.exit_code == 0
    assert done.stdout.startswith("Usage: ")


@pytest.mark.parametrize(
    "words", [(), ("scene",), ("params",), ("preset",), ("keys",), ("study",), ("service",)], ids=str
)
def test_no_line_of_a_list_of_commands_is_cut(words: tuple[str, ...]) -> None:
    done = CliRunner(env={"COLUMNS": "80"}).invoke(app, [*words, "-h"])
    assert done.exit_code == 0
    _, listed = done.stdout.split("Commands:")
    assert [line for line in listed.splitlines() if line.endswith("...")] == []


def test_its_version() -> None:
    done = CliRunner().invoke(app, ["--version"])
    assert (done.exit_code, done.stdout.split()) == (0, ["drumstick", version("haptic-drumstick")])


def test_a_command_that_is_nearly_one() -> None:
    done = CliRunner().invoke(app, ["simulte"])
    assert done.exit_code == 2
    assert "Did you mean 'simulate'?" in done.stderr


def test_a_scene_that_is_nearly_one() -> None:
    with pytest.raises(CommandError, match=r"no scene 'rol' \(did you mean 'roll'\?\); shipped: accents"):
        scene_file.read("rol")
    with pytest.raises(CommandError, match=r"no scene 'zzz'; shipped: accents"):
        scene_file.read("zzz")


def test_what_it_computes_starts_no_threads() -> None:
    """The library of linear algebra would start one for each processor, which spin beside the audio callback."""
    text = (
        "import atexit, os, sys\n"
        "from rig.cli.command import main\n"
        "atexit.register(lambda: print('threads', len(os.listdir('/proc/self/task'))))\n"
        "sys.argv = ['drumstick', 'scene', 'check', 'timpani']\n"
        "main()\n"
    )
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    command = [sys.executable, "-c", text]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1] == "threads 1", done.stderr
