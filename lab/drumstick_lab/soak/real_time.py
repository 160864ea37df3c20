"""The real-time form: the whole rig as processes, striking N times as often as the scene, watched from /proc."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drumstick_lab.soak import usage
from drumstick_lab.soak.processes.hearing import Hearing
from drumstick_lab.soak.processes.playing import Playing, wait_s
from drumstick_lab.soak.result import Result
from drumstick_lab.soak.samples import Samples
from drumstick_lab.soak.verdict import BREATH_KB, WARM_UP, Verdict, of_count, of_growth, unjudged
from realtime.stop import StopRequest
from rig.exit_status import OURS, CommandError, unavailable

_READY_WITHIN_S = 600.0  # the very first start compiles every kernel
_MAX_PAUSE_S, _SHORTEST_PAUSE_S, _SAMPLES = 5.0, 0.5, 200
# Bounds per hour at the usual rate of strikes; at N times the rate N of its hours pass in one.
RSS_KB_PER_H, DESCRIPTORS_PER_H, THREADS_PER_H = 100.0, 1.0, 1.0
RIG = "rig"


def soak(
    scene_text: str, duration_s: float, speed: float, place: Path, samples: Samples, say: Callable[[str], None],
    stop: StopRequest,
) -> Result:  # fmt: skip
    """Play for `duration_s` or until `stop`, and judge. Raises CommandError when the rig does not come up."""
    if not usage.is_readable():
        unavailable("--real-time reads /proc of every process: this system has none (Linux has)")
    playing = Playing(scene_text, place)
    hearing = Hearing(playing.endpoint, playing.rig)
    counts: dict[str, dict[str, Any]] = {}
    try:
        playing.start()
        _meet(playing, hearing, place, stop)
        playing.accompany(duration_s * WARM_UP / 2.0)
        before, begun = _seen(hearing), time.monotonic()
        _watch(playing, hearing, samples, duration_s, say, stop)
        after, lasted_s = _seen(hearing), time.monotonic() - begun
    finally:
        hearing.close()
        counts = playing.stop()
    strikes = after["strikes"] - before["strikes"]
    verdicts = [*_growths(samples, speed), *_counted(hearing, counts, before, after)]
    return Result("real-time", lasted_s, speed, strikes, strikes / lasted_s, verdicts, counts)


def _seen(hearing: Hearing) -> dict[str, int]:
    state, meter = hearing.state, hearing.meter
    assert state is not None
    assert meter is not None
    names = ("xruns", "late", "duplicates", "refused", "unpunctual", "played")
    return {
        "strikes": state.strikes,
        "overruns": state.overruns,
        "ring_dropped": state.ring_dropped,
        **{name: int(getattr(meter, name)) for name in names},
    }


def _meet(playing: Playing, hearing: Hearing, place: Path, stop: StopRequest) -> None:
    # Until the servo's state and the sound server's meter were heard.
    until = time.monotonic() + _READY_WITHIN_S
    opened = False
    while not stop.is_set():
        ended = playing.ended()
        if ended is not None or time.monotonic() > until:
            log = (place / "rig.log").read_text(encoding="utf-8", errors="replace").strip()
            raise CommandError(OURS, f"{ended or 'the rig was not ready in time'}; it said: {log[-1500:]}")
        opened = opened or hearing.open(stop)
        if hearing.state is not None and hearing.meter is not None and hearing.state.strikes > 0:
            return
        stop.wait(0.1)
    raise CommandError(OURS, "stopped before the rig was ready")


def _watch(
    playing: Playing, hearing: Hearing, samples: Samples, duration_s: float, say: Callable[[str], None],
    stop: StopRequest,
) -> None:  # fmt: skip
    pause_s = min(max(duration_s / _SAMPLES, _SHORTEST_PAUSE_S), _MAX_PAUSE_S)
    begun = time.monotonic()
    due = begun
    while not stop.is_set() and (t_s := time.monotonic() - begun) <= duration_s:
        used = playing.usages()
        for who, one in used.items():
            samples.note(t_s, who, one._asdict())
        samples.note(t_s, RIG, hearing.levels())
        if (ended := playing.ended()) is not None:
            raise CommandError(OURS, f"after {t_s:.0f} s {ended}")
        state = hearing.state
        megabytes = sum(one.pss_kB for one in used.values()) / 1e3
        say(
            f"{t_s:.0f} s of {duration_s:.0f}: {state.strikes if state else 0} strikes, {megabytes:.0f} MB in all"
        )
        due += pause_s
        wait_s(min(due, begun + duration_s + 0.01))


def _growths(samples: Samples, speed: float) -> list[Verdict]:
    verdicts: list[Verdict] = []
    for what, unit, bound in (
        ("rss_kB", "kB", RSS_KB_PER_H),
        ("descriptors", "descriptors", DESCRIPTORS_PER_H),
        ("threads", "threads", THREADS_PER_H),
    ):
        breath = BREATH_KB if unit == "kB" else 0.0
        verdicts += [
            of_growth(f"{who} {what}", unit, *samples.series(who, what), bound * speed, breath)
            for who in samples.whos(what)
        ]
    return verdicts


def _counted(
    hearing: Hearing, counts: dict[str, dict[str, Any]], before: dict[str, int], after: dict[str, int]
) -> list[Verdict]:
    more = {name: float(after[name] - before[name]) for name in after}
    osc, zenoh, visitor = (counts.get(name, {}) for name in ("osc", "zenoh", "visitor"))
    visits = f"of {visitor.get('visits', 0)} visits; {visitor.get('failure', '')}".removesuffix("; ")
    restarts = len(hearing.boots) + len(hearing.sounds) - 2
    nobody = 1 if not osc.get("heard") or not zenoh.get("heard") or not visitor.get("visits") else 0
    return [
        of_count("restarts", "times", restarts, 0, "servo and sound server started anew"),
        of_count("faults", "states", hearing.faults, 0, f"states of a fault {hearing.fault_words}".strip()),
        of_count("ring dropped", "events", more["ring_dropped"], 0, "events that found the ring full"),
        of_count(
            "zenoh missing", "strikes", zenoh.get("missing", 0), 0, "strikes that the Zenoh listener missed"
        ),
        of_count(
            "zenoh again", "strikes", zenoh.get("again", 0), 0, "strikes that came twice or out of order"
        ),
        of_count(
            "osc again", "strikes", osc.get("again", 0), 0, "strikes that came twice or out of order by OSC"
        ),
        of_count(
            "refused by sound", "messages", more["refused"], 0, "messages that the sound server refused"
        ),
        of_count("companions unheard", "times", nobody, 0, "a companion that heard or reached nobody"),
        of_count("visits failed", "times", visitor.get("failed", 0), 0, visits),
        unjudged("osc missing", "strikes", osc.get("missing", 0), f"of {osc.get('heard', 0)} by UDP"),
        unjudged("overruns", "ticks", more["overruns"], "ticks of the servo that were left out"),
        unjudged("xruns", "times", more["xruns"], "blocks that the sound server was late for"),
        unjudged("late", "strikes", more["late"], "strikes too late to sound"),
        unjudged("duplicates", "strikes", more["duplicates"], "strikes that the network brought twice"),
        unjudged(
            "unpunctual",
            "strikes",
            more["unpunctual"],
            f"came after their instant, of {more['played']:.0f} played",
        ),
    ]
