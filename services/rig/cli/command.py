"""The `drumstick` command line: every command by its name. --help must be instant."""

import logging
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from realtime.log import say
from rig.cli import laboratory, machine, offline, play, running, service, study
from rig.exit_status import LACKING, CommandError

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="The haptic drumstick: play it, hear it, tune it, send its strikes as OSC.",
)
_Commands = tuple[tuple[str, Callable[..., None]], ...]
_COMMANDS: _Commands = (
    ("up", play.up_command),
    ("haptic", play.haptic_command),
    ("sound", play.sound_command),
    ("panel", play.panel_command),
    ("simulate", offline.simulate_command),
    ("render", offline.render_command),
    ("analyse", offline.analyse_command),
    ("servo-test", machine.servo_test_command),
    ("audio-test", machine.audio_test_command),
    ("doctor", machine.doctor_command),
    ("record", running.record_command),
    ("replay", running.replay_command),
    ("rigs", running.rigs_command),
    ("monitor", running.monitor_command),
    ("play", running.play_command),
    ("panic", running.panic_command),
    ("arm", running.arm_command),
)
_LABORATORY: _Commands = (
    ("accuracy", laboratory.accuracy_command),
    ("soak", laboratory.soak_command),
    ("lab", laboratory.lab_command),
)
_GROUPS: tuple[tuple[str, str, _Commands], ...] = (
    (
        "scene",
        "Scenes: what is simulated, with which numbers.",
        (
            ("list", offline.scene_list),
            ("show", offline.scene_show),
            ("check", offline.scene_check),
            ("cost", offline.scene_cost),
        ),
    ),
    (
        "params",
        "Parameters of a running rig.",
        (
            ("get", running.params_get),
            ("set", running.params_set),
            ("watch", running.params_watch),
        ),
    ),
    (
        "preset",
        "Sets of parameters by name, kept by the haptic machine.",
        (
            ("save", running.preset_save),
            ("load", running.preset_load),
            ("list", running.preset_list),
            ("rename", running.preset_rename),
            ("delete", running.preset_delete),
        ),
    ),
    (
        "keys",
        "Certificates: who may speak to a rig from another machine.",
        (
            ("make", machine.keys_make),
            ("show", machine.keys_show),
        ),
    ),
    (
        "study",
        "Studies of practice: sessions with a metronome, logs, tables.",
        (
            ("run", study.study_run),
            ("export", study.study_export),
            ("forget", study.study_forget),
        ),
    ),
    (
        "service",
        "One process of a rig, for systemd (docs/install.md).",
        (
            ("servo", service.servo_command),
            ("gateway", service.gateway_command),
            ("door", service.access_command),
            ("sound", service.sound_command),
            ("panel", service.panel_command),
            ("servo-reload", service.servo_reload_command),
            ("servo-ticks", service.servo_ticks_command),
            ("servo-ended", service.servo_ended_command),
        ),
    ),
)


def _print_version(wanted: bool) -> None:
    if wanted:
        import drumstick

        print(f"drumstick {drumstick.__version__}")
        raise typer.Exit


@app.callback()
def _before_any_command(  # pyright: ignore[reportUnusedFunction]
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    pass


for _name, _command in _COMMANDS:
    app.command(_name)(_command)
for _name, _command in _LABORATORY:
    app.command(_name, context_settings=laboratory.SETTINGS, add_help_option=False)(_command)
for _group, _words, _commands in _GROUPS:
    _typer = typer.Typer(no_args_is_help=True, help=_words)
    for _name, _command in _commands:
        _typer.command(_name)(_command)
    app.add_typer(_typer, name=_group)


def _leave(status: int, message: str) -> NoReturn:
    if message:
        say(logging.ERROR, f"drumstick: {message}")
    sys.exit(status)


def _open_closed_streams() -> None:
    # Whoever started us closed them: no file that is opened later may take their place and get what is printed.
    while (fd := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(fd)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115  until the process ends


def main() -> None:
    """Entry point; exit status 0 done, 2 what was given is wrong, 3 the machine lacks something, 1 a fault of ours."""
    _open_closed_streams()
    # A bank of modes is hundreds of eigenvalue problems of some 60 unknowns: more threads make each slower, and spin
    # beside the audio callback. Numpy is not imported yet; processes started from here inherit it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        app(prog_name=Path(sys.argv[0]).name)
    except CommandError as stop:
        _leave(stop.status, str(stop))
    except KeyboardInterrupt:
        _leave(130, "interrupted")
    except BrokenPipeError:
        sys.stderr.close()  # the reader of our output went away, as `head` does
        sys.exit(0)
    except OSError as error:  # a full disk, a folder that may not be written: the machine's, not ours
        _leave(LACKING, str(error))
