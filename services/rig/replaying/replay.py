"""`drumstick replay`: a recording on the wires again, in the haptic server's place."""

import json
import logging
import math
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from protocol.endpoint import host_and_port
from protocol.keys import Keys
from realtime.log import say
from realtime.stop import StopRequest, on_stop_signals
from rig.exit_status import unavailable, usage_error
from rig.network import osc_targets, ports
from rig.network.remote import attempt
from rig.network.remote_rig import RemoteRig

if TYPE_CHECKING:
    import zenoh

    from drumstick.parameters.scene import Scene
    from rig.recording.reading import Recording
    from rig.replaying.cues import Cue

_ON_ITS_WAY_S = 0.2  # what was put last is heard before the session ends
_POLL_S = 0.1
_LEAD_S = 1.0  # for those who only now find a router: they try twice a second


class ReplayOptions(NamedTuple):
    """Options of a replay; `connect` None: this is the Zenoh router itself, at `listen`."""

    file: Path
    speed: float
    loop: bool
    await_sound: bool
    listen: str
    connect: str | None
    osc_out: tuple[str, ...]
    prefix: str
    longest_s: float  # one bad time would make it wait for years


def load(path: Path) -> tuple["Recording", "Scene"]:
    """A recording with strikes and a scene. CommandError with what is wrong with it."""
    from rig.recording import channels
    from rig.recording.reading import RecordingError, read
    from rig.recording.recorder import scene_of

    try:
        recording = read(path)
        if not recording.of(channels.STRIKE):
            usage_error(f"{path}: no strikes in it{f'; it {recording.torn}' if recording.torn else ''}")
        if not recording.scenes:
            usage_error(f"{path}: no scene in it: nobody would know which drum to play")
        return recording, scene_of(recording.scenes[0])
    except RecordingError as error:
        usage_error(str(error))
    except ValueError as error:
        usage_error(f"{path}: its scene cannot be read: {error}")


def _cues(recording: "Recording", options: ReplayOptions) -> "list[Cue]":
    # What is to be played when. CommandError with what no servo can have told, and where nobody can have meant so long
    # a play.
    from rig.replaying.cues import cues_of

    try:
        cues = cues_of(recording.events, options.speed)
    except ValueError as error:
        usage_error(f"{options.file}: {error}")
    lasts_s = cues[-1].at_ns * 1e-9
    if lasts_s > options.longest_s:
        gap_s, at_s = max((b.at_ns - a.at_ns, a.at_ns) for a, b in pairwise(cues))
        usage_error(
            f"{options.file}: would play for {lasts_s:.4g} s, {gap_s * 1e-9:.4g} s of it in silence after the first"
            f" {at_s * 1e-9:.4g} s: is a time in it wrong? More than {options.longest_s:g} s are played only when asked"
            f" for: --longest {math.ceil(lasts_s)}"
        )
    return cues


@contextmanager
def _session(keys: Keys, options: ReplayOptions) -> "Generator[zenoh.Session]":
    import zenoh

    from protocol.session import open_router
    from rig.replaying.replay_server import present

    try:
        if options.connect is None:
            ports.require_free_tcp(*host_and_port(options.listen), "Zenoh port", "--listen")
            session = open_router(options.listen)
        else:
            session, _ = attempt(RemoteRig(options.connect, keys))
    except zenoh.ZError:
        session = None
    if session is None:
        unavailable(f"no Zenoh router answers at {options.connect}: start it, or leave out --connect")
    try:
        if options.connect is not None and present(session, keys.alive("haptic", "*")):
            unavailable(
                f"rig {keys.rig!r} is played there already: stop it, or give the replay another name with --rig"
            )
        yield session
    finally:
        session.close()


def _say(words: str) -> None:
    say(logging.INFO, f"replay: {words}")


def _await_sound(session: "zenoh.Session", keys: Keys, enough: Callable[[], bool]) -> None:
    from rig.replaying.replay_server import present

    _say(f"waiting for a sound server of rig {keys.rig!r}")
    while not enough() and not present(session, keys.alive("sound", "*")):
        time.sleep(_POLL_S)


def replay(keys: Keys, options: ReplayOptions, as_json: bool) -> None:
    """Play the recording, then say how it went. Raises CommandError."""
    recording, scene = load(options.file)
    cues = _cues(recording, options)
    stop = StopRequest()
    on_stop_signals(stop.ask)
    if recording.torn:
        _say(f"{options.file} {recording.torn}; it is played as far as it goes")
    if len(recording.scenes) > 1:
        _say(
            f"the scene changed {len(recording.scenes) - 1} times in it; {scene.name!r}, the first, is answered"
        )
    # By another name than the rig's: this one may play here at the same time, at a router of its own.
    osc_targets.warn(osc_targets.Sender(f"replay of {keys.rig}", options.osc_out, options.prefix))
    with _session(keys, options) as session:
        summary = _played(session, keys, options, recording, cues, scene, stop)
    print(json.dumps(summary) if as_json else _words(summary))


def _played(
    session: "zenoh.Session",
    keys: Keys,
    options: ReplayOptions,
    recording: "Recording",
    cues: "list[Cue]",
    scene: "Scene",
    stop: StopRequest,
) -> dict[str, Any]:
    from drumstick.scenes.table import table_of
    from rig.replaying.cues import Renumbering, numbers_of
    from rig.replaying.osc_out import OscOut
    from rig.replaying.player import ReplayPlayer
    from rig.replaying.replay_server import ReplayServer, new_boot

    boot, panic = new_boot(), StopRequest()
    what = f"a replay of {options.file.name}"
    stand_in = ReplayServer(
        session, keys, boot, recording.scenes[0], what, panic.ask, lambda: {"replay": str(options.file)}
    )
    osc = OscOut(options.osc_out, options.prefix, table_of(scene))
    renumbering = Renumbering(boot, numbers_of(cues))
    player = ReplayPlayer(cues, renumbering, stand_in, osc, keys.rig, panic.is_set)
    try:
        if options.await_sound:
            _await_sound(session, keys, lambda: stop.is_set() or panic.is_set())
        begun = time.monotonic()
        end = player.play(stop, options.loop, _LEAD_S)
        lasted_s = max(time.monotonic() - begun - _LEAD_S, 0.0)
        time.sleep(_ON_ITS_WAY_S)
    finally:
        osc.close()
        stand_in.close()
    late = player.lateness
    return {
        "file": str(options.file),
        "rig": keys.rig,
        "boot": boot,
        "end": end,
        "duration_s": round(lasted_s, 3),
        "passes": player.passes,
        "messages": dict(sorted(player.count.items())),
        "lateness_p50_us": late.percentile_us(0.5),
        "lateness_p99_us": late.percentile_us(0.99),
        "lateness_worst_us": late.worst_ns / 1e3,
        "late": late.late,
        "osc_unsent": osc.unsent,
        "torn": recording.torn or None,
    }


def _words(summary: dict[str, Any]) -> str:
    strikes = summary["messages"].get("/strike", 0)
    lines = [
        f"{summary['file']}: {summary['end']} after {summary['duration_s']:.1f} s, {strikes} strikes,"
        f" {sum(summary['messages'].values())} messages",
        f"  lateness: p50 {summary['lateness_p50_us'] / 1e3:.2f} ms, p99 {summary['lateness_p99_us'] / 1e3:.2f} ms,"
        f" worst {summary['lateness_worst_us'] / 1e3:.2f} ms; {summary['late']} later than 2 ms",
    ]
    if summary["torn"]:
        lines.append(f"  the file {summary['torn']}")
    return "\n".join(lines)


def checked(options: ReplayOptions) -> ReplayOptions:
    """Check the options of a replay. Raises CommandError."""
    from rig import checks
    from rig.supervision.resolved_options import require_loopback

    checks.finite(options.speed, "--speed", 0.01, 100.0, "times the recorded one")
    checks.finite(options.longest_s, "--longest", 0.0, 1e13, "s")
    checks.endpoint(options.connect)
    require_loopback(checks.endpoint(options.listen, "--listen"))
    checks.prefix(options.prefix)
    return options._replace(osc_out=tuple(checks.known_target(target) for target in options.osc_out))
