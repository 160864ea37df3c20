"""The commands for a rig that runs: its parameters and presets, panic, arm, and what it does as a recording."""

from pathlib import Path
from typing import Annotated

import typer

from protocol.keys import DEFAULT_ROUTER
from protocol.osc import DEFAULT_PREFIX
from rig.cli.grouped import grouped
from rig.options import (
    Connect,
    Duration,
    Json,
    Listen,
    OscOut,
    PlaybackOptions,
    Prefix,
    PresetName,
    PresetNewName,
    PresetOldName,
    RigFile,
    RigName,
    RigNameOrFile,
)


def record_command(
    out: Annotated[Path, typer.Option(help="The new MCAP file; one that exists is never overwritten.")],
    force: Annotated[
        bool,
        typer.Option(
            "--force", help='Record contact force too (only for scenes with excitation = "streamed").'
        ),
    ] = False,
    duration: Annotated[float | None, typer.Option(help="Stop after this many seconds.")] = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Record a running rig. Strikes, parameters, state, meters; until Ctrl-C."""
    from rig import checks
    from rig.network.remote_rig import FOLLOWERS, remote_rig
    from rig.recording.record import record

    checks.duration(duration)
    record(remote_rig(rig_file, rig, connect, roles=FOLLOWERS), out, force, duration, as_json)


@grouped
def replay_command(
    file: Annotated[Path, typer.Argument(help="A recording (.mcap); a truncated one plays up to its end.")],
    *,
    playback: PlaybackOptions,
    rig: RigName = "main",
    connect: Connect = None,
    listen: Listen = DEFAULT_ROUTER,
    osc_out: OscOut = None,
    prefix: Prefix = DEFAULT_PREFIX,
    as_json: Json = False,
) -> None:
    """Play a recording again. Its strikes go out over Zenoh and OSC, as if the rig played."""
    from rig import checks
    from rig.replaying.replay import ReplayOptions, checked, replay

    _, keys = checks.wire(rig, connect)
    out = osc_out or [checks.DEFAULT_TARGET]
    how = (playback.speed, playback.loop, playback.await_sound)
    options = ReplayOptions(file, *how, listen, connect, tuple(out), prefix, playback.longest)
    replay(keys, checked(options), as_json)


def rigs_command(
    watch: Annotated[
        bool,
        typer.Option(
            "--watch", help="Keep watching: print what appears, changes and disappears, until Ctrl-C."
        ),
    ] = False,
    duration: Annotated[
        float | None, typer.Option(help="With --watch: stop after this many seconds.")
    ] = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """List the rigs on this network. Scene, state, strikes, who is there; with --watch and --json one object a line."""
    from rig import checks
    from rig.network import rigs
    from rig.network.remote_rig import READERS, remote_rig

    checks.duration(duration)
    end = remote_rig(rig_file, None, connect, roles=READERS)
    if watch:
        rigs.watch(end, as_json, duration)
    else:
        rigs.show(end, as_json)


def monitor_command(
    duration: Duration = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Watch a running rig.

    One line a second, with --json one object a line: state, roll rate, sound, and how well each strike's forecast of
    force fits the contact that follows.
    """
    from rig import checks
    from rig.network.monitor import monitor
    from rig.network.remote_rig import FOLLOWERS, remote_rig

    checks.duration(duration)
    monitor(remote_rig(rig_file, rig, connect, roles=FOLLOWERS), as_json, duration)


def panic_command(rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None) -> None:
    """Cut all force now. It stays off until `drumstick arm`.

    A reboot of the haptic machine, or a new `drumstick up`, `drumstick haptic` or container also restores it.
    """
    from rig.network import remote
    from rig.network.remote_rig import remote_rig

    remote.panic(remote_rig(rig_file, rig, connect))


def arm_command(rig: RigName = "main") -> None:
    """Restore force after a panic or fault. Run it on the machine with the stick, hands clear."""
    from rig import checks
    from rig.supervision import arm

    checks.rig_name(rig)
    arm.arm(rig)


def play_command(
    rate: Annotated[float | None, typer.Option(help="Rate of the roll, Hz; as it is if not given.")] = None,
    level: Annotated[
        float | None,
        typer.Option(help="Level of its strikes, above 0 and up to 1; as it is if not given."),
    ] = None,
    seconds: Annotated[float, typer.Option(help="Ramp there over this many seconds.")] = 0.0,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Play a roll of this rate and level on a running rig. Without either: print what it plays."""
    from rig.exit_status import usage_error

    if seconds and rate is None and level is None:
        usage_error("--seconds: give --rate or --level too")
    from rig.network import remote
    from rig.network.remote_rig import remote_rig

    remote.play(remote_rig(rig_file, rig, connect), rate, level, seconds, as_json)


def params_get(
    names: Annotated[
        list[str] | None, typer.Argument(help="Parameter names, e.g. dv_pls k_coll. Default: all.")
    ] = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Print the values that the servo uses now."""
    from rig.network import remote
    from rig.network.remote_rig import READERS, remote_rig

    remote.params_get(remote_rig(rig_file, rig, connect, roles=READERS), names or [], as_json)


def params_set(
    pairs: Annotated[list[str], typer.Argument(help="NAME=VALUE ..., all accepted or none.")],
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Set parameters while it plays."""
    from rig.network import remote
    from rig.network.remote_rig import remote_rig

    remote.params_set(remote_rig(rig_file, rig, connect), pairs, as_json)


def params_watch(
    rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None, duration: Duration = None
) -> None:
    """Print every accepted change."""
    from rig.network import remote
    from rig.network.remote_rig import READERS, remote_rig

    remote.params_watch(remote_rig(rig_file, rig, connect, roles=READERS), duration)


def preset_save(
    name: PresetName, rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None
) -> None:
    """Keep the parameters as they are now, on the haptic machine."""
    from rig.network import remote
    from rig.network.remote_rig import remote_rig

    remote.preset_save(remote_rig(rig_file, rig, connect), name)


def preset_rename(
    name: PresetOldName,
    new: PresetNewName,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
) -> None:
    """Give a preset another name. Refused while somebody else has locked the tuning."""
    from rig.network import remote
    from rig.network.remote_rig import remote_rig

    remote.preset_rename(remote_rig(rig_file, rig, connect), name, new)


def preset_delete(
    name: PresetName, rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None
) -> None:
    """Delete a preset for good, without asking. Refused while somebody else has locked the tuning."""
    from rig.network import remote
    from rig.network.remote_rig import remote_rig

    remote.preset_delete(remote_rig(rig_file, rig, connect), name)


def preset_load(
    name: PresetName,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Set everything that the preset holds, or nothing."""
    from rig.network import remote
    from rig.network.remote_rig import remote_rig

    remote.preset_load(remote_rig(rig_file, rig, connect), name, as_json)


def preset_list(
    rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None, as_json: Json = False
) -> None:
    """Every preset of the rig."""
    from rig.network import remote
    from rig.network.remote_rig import READERS, remote_rig

    remote.preset_list(remote_rig(rig_file, rig, connect, roles=READERS), as_json)
