"""`drumstick record`: what a running rig does, into an MCAP file, until Ctrl-C or for a while."""

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from realtime.stop import StopRequest, on_stop_signals
from rig.exit_status import unavailable, usage_error
from rig.network.remote_rig import RemoteRig

if TYPE_CHECKING:
    from rig.recording.recorder import Result

SUFFIX = ".mcap"


def check_out(out: Path, option: str) -> None:
    """Stop unless a new recording can be made there."""
    if out.suffix != SUFFIX:
        usage_error(f"{option} {out}: a recording's name ends in {SUFFIX}")
    if out.exists() or out.is_symlink():
        usage_error(f"{option} {out}: exists already; recordings are never overwritten: give another name")
    if not out.parent.is_dir():
        usage_error(f"{option} {out}: there is no folder {out.parent}")


def recorded(
    end: RemoteRig,
    out: Path,
    *,
    force: bool = False,
    duration_s: float | None = None,
    wait: bool = False,
    say: Callable[[str], None] | None = None,
) -> "Result":
    """Record until SIGINT, SIGTERM or SIGHUP, or for `duration_s`. Raises CommandError, also when the disk took no
    more.

    `wait`: for a rig that is not there yet. The main thread.
    """
    from rig.recording.recorder import NoForce, NoRig, Recorder, to_stderr

    stop = StopRequest()
    on_stop_signals(stop.ask)
    try:
        result = Recorder(end, out, force, wait, say or to_stderr).run(stop, duration_s)
    except FileExistsError:
        usage_error(f"{out}: exists already; recordings are never overwritten: give another name")
    except NoRig as error:
        unavailable(str(error))
    except NoForce as error:
        usage_error(f'{error}: play one with [drum] excitation = "streamed", or record without --force')
    except OSError as error:
        unavailable(f"{out}: cannot be written: {error.strerror}")
    if result.failure is not None:
        unavailable(
            f"{out}: {result.failure}; the recording ends here, after {result.messages.get('/strike', 0)} strikes,"
            " and stays readable to its last whole chunk; the rig plays on"
        )
    return result


def words(result: "Result") -> str:
    """A recording in words: what it holds, and what it lacks."""
    strikes = result.messages.get("/strike", 0)
    lines = [
        f"{result.file}: {result.duration_s:.1f} s, {strikes} strikes, {sum(result.messages.values())} messages,"
        f" {result.bytes / 1e3:.0f} kB"
    ]
    if result.missing:
        lines.append(f"  never came: {_counted(result.missing)} (the network or the rig lost them)")
    if result.lost:
        lines.append(f"  came faster than they could be written: {_counted(result.lost)}")
    if result.unreadable:
        lines.append(f"  left out: {result.unreadable} messages that could not be read")
    return "\n".join(lines)


def _counted(counts: dict[str, int]) -> str:
    return ", ".join(f"{n} of {topic}" for topic, n in sorted(counts.items()))


def record(end: RemoteRig, out: Path, force: bool, duration_s: float | None, as_json: bool) -> None:
    """Record a rig that runs, and say what there is in the file. Raises CommandError."""
    check_out(out, "--out")
    result = recorded(end, out, force=force, duration_s=duration_s)
    print(json.dumps(asdict(result)) if as_json else words(result))
