"""The commands about machines: whether this one is fit, and the certificates of all."""

from pathlib import Path
from typing import Annotated

import typer

from rig.options import AudioRate, Json, RigFile, RigNameOrFile, Scene
from sound_server.ranges import BLOCKS, DEFAULT_RATE_HZ, RATES_HZ


def servo_test_command(
    scene: Scene = "roll",
    seconds: Annotated[float, typer.Option(help="How long to watch the loop.")] = 10.0,
    as_json: Json = False,
) -> None:
    """Judge this machine's force loop. Measures its jitter for 10 s, and says whether that is good enough."""
    from rig import checks
    from rig.machine.servo_test import servo_test

    checks.finite(seconds, "--seconds", 0.5, 3600.0, "s")
    servo_test(scene, seconds, as_json)


def audio_test_command(
    scene: Scene = "roll",
    audio: Annotated[
        str,
        typer.Option(
            help="auto (the default device), null (no device: only what computing takes), or part of a device's name."
        ),
    ] = "auto",
    audio_rate: AudioRate = DEFAULT_RATE_HZ,
    audio_block: Annotated[
        list[int] | None,
        typer.Option(
            help=f"Frames per audio block to try, {BLOCKS[0]} to {BLOCKS[1]}; may be repeated. Without: 32 to 1024,"
            " and with JACK the one that it has."
        ),
    ] = None,
    seconds: Annotated[float, typer.Option(help="How long to play each block size at each priority.")] = 3.0,
    as_json: Json = False,
) -> None:
    """Find the audio block and priority for this machine. Says how late strikes then sound, and whether it matters."""
    from rig import checks
    from rig.machine.audio_test import audio_test

    blocks = audio_block or []
    checks.finite(seconds, "--seconds", 0.5, 600.0, "s")
    checks.finite(audio_rate, "--audio-rate", RATES_HZ[0], RATES_HZ[1], "Hz")
    for block in blocks:
        checks.finite(block, "--audio-block", BLOCKS[0], BLOCKS[1], "frames")
    audio_test(scene, audio, audio_rate, blocks, seconds, as_json)


def doctor_command(rig: RigNameOrFile = None, rig_file: RigFile = None, as_json: Json = False) -> None:
    """Check this machine; show the last fault. The fault as a plot; with --rig-file also who was turned away."""
    from rig.machine.doctor import doctor

    raise typer.Exit(doctor(as_json, rig, rig_file))


def keys_make(
    out: Annotated[
        Path,
        typer.Option(
            help="Output folder, new or empty; it gets one subfolder per machine. With --renew: the folder"
            " that an earlier `keys make` made."
        ),
    ],
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
        str | None, typer.Option(help="Make only this role's certificate again, by the authority in --out.")
    ] = None,
) -> None:
    """Create a private CA and one certificate per role. Roles: haptic, sound, panel, technician, listener."""
    from rig import checks
    from rig.identity import keys as rig_keys

    checks.finite(days, "--days", 1.0, rig_keys.MAX_DAYS, "days")
    if renew is None:
        rig_keys.make(out, rig, host or [], days, router or [])
    else:
        rig_keys.renew(out, renew, host or [], days)


def keys_show(
    folder: Annotated[Path, typer.Argument(help="A folder that `keys make` made, or one of its folders.")],
    as_json: Json = False,
) -> None:
    """Show who each certificate is for, and until when it is valid."""
    from rig.identity import keys as rig_keys

    rig_keys.show(folder, as_json)
