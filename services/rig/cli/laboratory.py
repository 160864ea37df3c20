"""The commands that measure come from the laboratory, a distribution of its own, by entry point."""

from importlib.metadata import entry_points

import typer

from rig.exit_status import unavailable

_GROUP = "drumstick.laboratory"
# The laboratory reads what follows, --help too.
SETTINGS = {"allow_extra_args": True, "ignore_unknown_options": True, "allow_interspersed_args": False}


def _run(context: typer.Context) -> None:
    name = context.info_name or ""
    found = next(iter(entry_points(group=_GROUP, name=name)), None)
    if found is None:
        unavailable(
            f"{name} needs the laboratory: in a checkout type: make install, or pip install --no-deps -e lab"
        )
    command = typer.main.get_command(found.load())
    with command.make_context(name, list(context.args), parent=context.parent) as inner:
        command.invoke(inner)


def accuracy_command(context: typer.Context) -> None:
    """Measure what accuracy costs here. The time of stick, servo, mesh, excitation, effects; with figures."""
    _run(context)


def soak_command(context: typer.Context) -> None:
    """Endurance test. Looks for leaks and drift in memory, descriptors, threads, counters and clocks."""
    _run(context)


def lab_command(context: typer.Context) -> None:
    """The laboratory's programs. Benchmarks, torture, fuzzing, mutation, made pages; without a name it lists them."""
    _run(context)
