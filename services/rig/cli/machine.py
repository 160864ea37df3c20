"""The commands about machines: whether this one is fit, and the certificates of all."""

from pathlib import Path
from typing import Annotated

import typer

from rig.cli.options import Json, RigFile, RigNameOrFile, Scene


def servo_test_command(
    scene: Scene = "roll",
    seconds: Annotated[float, typer.Option(help="How long to watch the loop.")] = 10.0,
    as_json: Json = False,
) -> None:
    """Ten seconds of the force loop: how late it is, and whether this machine is fit for it."""
    from rig import checks
    from rig.machine.servo_test import servo_test

    checks.finite(seconds, "--seconds", 0.5, 3600.0, "s")
    servo_test(scene, seconds, as_json)


def doctor_command(rig: RigNameOrFile = None, rig_file: RigFile = None, as_json: Json = False) -> None:
    """What this machine has and lacks for playing; the rig's last fault here, drawn; whom it turned away."""
    from rig.machine.doctor import doctor

    raise typer.Exit(doctor(as_json, rig, rig_file))


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
        typer.Option(help="So many times the scene's strikes, by a quicker stick; 1, or 20 in real time."),
    ] = None,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="The whole rig as processes, instead of virtual time in one.")
    ] = False,
    as_json: Json = False,
    out: Annotated[
        Path | None, typer.Option(help="Also write soak.json, soak.csv and a figure into this folder.")
    ] = None,
) -> None:
    """Does anything grow, wrap or drift while it plays for long: memory, descriptors, threads, counters, clocks."""
    from rig import checks

    if duration is not None:
        checks.finite(duration, "--duration", 10.0, 1e7, "s")
    if speed is not None:
        checks.finite(speed, "--speed", 1.0, 100.0, "times the scene's strikes")
    from drumstick_lab.soak.command import soak

    if not soak(scene, duration, speed, real_time, as_json, out):
        raise typer.Exit(1)


def keys_make(
    out: Annotated[Path, typer.Option(help="A new folder; it gets one folder for each machine to carry.")],
    rig: RigNameOrFile = None,
    host: Annotated[
        list[str] | None,
        typer.Option(help="Name or address by which others reach the haptic machine; may be repeated."),
    ] = None,
    router: Annotated[
        list[str] | None,
        typer.Option(
            help="Name or address of a Zenoh router on a machine of its own: it gets a folder too, and all"
            " connect to it (docs/network.md); may be repeated."
        ),
    ] = None,
    days: Annotated[int, typer.Option(help="How long the certificates are valid, 1 to 825.")] = 365,
    renew: Annotated[
        str | None, typer.Option(help="Make only this role's certificate anew, by the authority in --out.")
    ] = None,
) -> None:
    """A small authority, and a certificate for each role: haptic, sound, panel, technician, listener."""
    from rig import checks
    from rig.identity import keys as rig_keys

    checks.finite(days, "--days", 1.0, rig_keys.LONGEST_DAYS, "days")
    if renew is None:
        rig_keys.make(out, rig, host or [], days, router or [])
    else:
        rig_keys.renew(out, renew, host or [], days)


def keys_show(
    folder: Annotated[Path, typer.Argument(help="A folder that `keys make` made, or one of its folders.")],
    as_json: Json = False,
) -> None:
    """Who each certificate is for, and until when."""
    from rig.identity import keys as rig_keys

    rig_keys.show(folder, as_json)
