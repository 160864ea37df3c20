"""The laboratory's commands of `drumstick`, found there by entry point. Nothing heavy is imported before one runs."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from rig.options import Json, Scene


def accuracy_command(
    quick: Annotated[bool, typer.Option("--quick", help="Fewer cases: under three minutes.")] = False,
    as_json: Json = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the result and its figures; without it, a folder of this user's own (named at the end)."
        ),
    ] = None,
) -> None:
    """Measure what accuracy costs here. The time of stick, servo, mesh, excitation, effects; with figures."""
    from drumstick_lab.accuracy.command import accuracy

    accuracy(quick, as_json, out)


def soak_command(
    scene: Scene = "roll",
    duration: Annotated[
        float | None,
        typer.Option(
            help="Seconds, virtual ones without --real-time; 3600, or 1800 in real time, if not given."
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            help="Multiply the scene's rate of strikes by this, with a lighter, quicker stick; 1, or 20 with --real-time, if"
            " not given."
        ),
    ] = None,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="The whole rig as processes, instead of virtual time in one.")
    ] = False,
    as_json: Json = False,
    out: Annotated[
        Path | None, typer.Option(help="Also write soak.json, soak.csv and a figure into this folder.")
    ] = None,
) -> None:
    """Endurance test. Looks for leaks and drift in memory, descriptors, threads, counters and clocks."""
    from rig import checks

    if duration is not None:
        checks.finite(duration, "--duration", 10.0, 1e7, "s")
    if speed is not None:
        checks.finite(speed, "--speed", 1.0, 100.0, "times the scene's strikes")
    from drumstick_lab.soak.command import soak

    if not soak(scene, duration, speed, real_time, as_json, out):
        raise typer.Exit(1)


def lab_command(
    program: Annotated[str | None, typer.Argument(help="One of the programs; none: list them.")] = None,
    arguments: Annotated[list[str] | None, typer.Argument(help="The program's own; try --help.")] = None,
) -> None:
    """Run one of the laboratory's programs, or list them. Benchmarks, torture, fuzzing, mutation, made pages."""
    from drumstick_lab.programs import module_of, programs, words_of
    from rig.exit_status import usage_error

    if program is None:
        for name, words in programs().items():
            print(f"{name:24s}{words}")
        return
    try:
        module, words = module_of(program), words_of(program)
    except LookupError:
        usage_error(f"lab {program}: there is no such program; drumstick lab lists them")
    if arguments and words is not None:  # it would not look at them, and measure for minutes
        if {"--help", "-h"} & set(arguments):
            print(f"{words}\n\nNo options.")
            return
        usage_error(f"lab {program} has no options: {' '.join(arguments)}")
    sys.stdout.flush()
    os.execv(sys.executable, [sys.executable, "-m", module, *(arguments or [])])


def _app() -> typer.Typer:
    return typer.Typer(add_completion=False, rich_markup_mode=None)


ACCURACY, SOAK, LAB = _app(), _app(), _app()
ACCURACY.command()(accuracy_command)
SOAK.command()(soak_command)
# What follows the program's name is the program's, --help too.
LAB.command(context_settings={"allow_interspersed_args": False, "ignore_unknown_options": True})(lab_command)
