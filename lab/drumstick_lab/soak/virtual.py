"""The virtual form: the servo's own ticks and everything that its strikes go through, faster than time passes.

The clock begins shortly before 2^53 ns, the ticks before 2^31, the strikes before OSC's 2^31: each is passed in the
middle. What is watched are this process's memory, descriptors and threads, over virtual hours.
"""

import gc
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.soak.in_process import ticks
from drumstick_lab.soak.in_process.gateway import Gateway
from drumstick_lab.soak.in_process.hearers import Clocks, Recording, VirtualSound
from drumstick_lab.soak.in_process.local_wire import LocalSession, Take
from drumstick_lab.soak.in_process.ticks import Comb, Counted
from drumstick_lab.soak.result import Result
from drumstick_lab.soak.samples import Samples
from drumstick_lab.soak.usage import usage
from drumstick_lab.soak.verdict import BREATH_KB, Verdict, of_count, of_growth, unjudged
from haptic_server.records import PLAYING
from realtime import ring
from realtime.stop import StopRequest

SAMPLES = 60
STEP_S = 0.034  # so often the relay goes round: a state in every round
_COMPARE_EVERY_S, _VISIT_EVERY_S = 10.0, 30.0
# Bounds per virtual hour at the usual rate of strikes.
RSS_KB_PER_H, BLOCKS_PER_H, DESCRIPTORS_PER_H, THREADS_PER_H = 100.0, 1000.0, 1.0, 1.0
# Of a strike from its place in the exact cycle while nobody sets anything: whole ns, and one to spare.
_MAX_OFF_NS = 2.0
WHO = "process"


class Virtual:
    """`also` hears every strike message too; `place`: a folder of this run's own."""

    def __init__(self, scene_text: str, place: Path, span_s: float, also: Take | None = None) -> None:
        self._scene: Scene = parse(scene_text, "soak")
        self._servo = ticks.servo_of(self._scene, place)
        self._period_ns = int(self._servo.plan["period_ns"][0])
        self._steps = max(round(STEP_S * 1e9 / self._period_ns), 1)
        self.span_ticks = round(span_s * 1e9 / self._period_ns)
        half = self.span_ticks // 2
        # How many strikes there will be is not known beforehand; at 1 Hz or at 1000, the limit is passed early on.
        ticks.begin_at(self._servo, Counted(2**31 - half, 2**31 - max(round(span_s * 2), 2)))
        self._start_ns = self._now_ns = (2**53 // self._period_ns - half) * self._period_ns
        self._began = int(self._servo.tick_state["seq"][0])
        session = LocalSession()
        self._gateway = Gateway(self._scene, place, session)
        self._clocks = Clocks(self._gateway.link.boot, self._start_ns)
        self._sound = VirtualSound(self._clocks)
        self._recording = Recording(place / "soak.mcap", self._scene, self._clocks)
        keys = self._gateway.keys
        for key, take in (
            (keys.strike, self._sound.take),
            (keys.strike, self._recording.strike),
            (keys.release, self._recording.release),
            (keys.state, self._recording.state),
        ):
            session.subscribe(key, take)
        if also is not None:
            session.subscribe(keys.strike, also)
        self._fill()

    def _fill(self) -> None:
        # What is bounded is filled before anything is watched, or it would look like growth: the pages of the block,
        # which this process has mapped twice; the strikes that the scheduler remembers; two minutes of clock comparisons.
        for block in (self._servo.block, self._gateway.link.block):
            block.events.copy()
        self._sound.fill()
        for ago_s in range(180, 0, -round(_COMPARE_EVERY_S)):
            self._clocks.compare(self._now_ns - ago_s * ticks.SECOND_NS)
        gc.collect()
        gc.freeze()  # what is there now is not looked through at every sample

    def run(self, samples: Samples, say: Callable[[str], None], stop: StopRequest) -> None:
        """The whole span, or until `stop`."""
        done, per_s = 0, 1e9 / self._period_ns
        due = {"sample": 0.0, "compare": 0.0, "visit": _VISIT_EVERY_S}
        every = {
            "sample": self.span_ticks / per_s / SAMPLES,
            "compare": _COMPARE_EVERY_S,
            "visit": min(_VISIT_EVERY_S, self.span_ticks / per_s / SAMPLES),
        }
        while done < self.span_ticks and not stop.is_set():
            now_s = done / per_s
            for what, at_s in due.items():
                if now_s >= at_s:
                    due[what] += every[what]
                    self._do(what, now_s, samples, say)
            count = min(self._steps, self.span_ticks - done)
            self._now_ns = ticks.run(self._servo, count, self._now_ns)
            done += count
            for part in (self._sound, self._recording, self._gateway):
                part.step(self._now_ns)
        self._do("sample", done / per_s, samples, say)

    def _do(self, what: str, now_s: float, samples: Samples, say: Callable[[str], None]) -> None:
        if what == "compare":
            self._recording.learn(self._clocks.compare(self._now_ns))
        elif what == "visit":
            self._gateway.visit()
        else:
            self._sample(now_s, samples)
            say(f"{now_s:.0f} s of virtual time, {self.strikes} strikes")

    def _sample(self, now_s: float, samples: Samples) -> None:
        gc.collect()
        used = usage(os.getpid())
        samples.note(
            now_s,
            WHO,
            {
                "rss_kB": used.rss_kB,
                "python_blocks": sys.getallocatedblocks(),
                "descriptors": used.descriptors,
                "threads": used.threads,
                "clock_error_us": self._clocks.error_ns / 1e3,
            },
        )

    @property
    def strikes(self) -> int:
        """Made since the start."""
        return int(self._servo.tick_state["seq"][0]) - self._began

    def close(self) -> None:
        """End what has threads or files."""
        gc.unfreeze()
        self._gateway.close()
        self._recording.close()

    def counted(self) -> list[Verdict]:
        """Counts of what was lost, came twice, wrapped or was wrongly timed."""
        sound, recorded, heard = self._sound.scheduler, self._recording, self._gateway.heard
        cells, strikes = self._servo.block.ring_cells, self.strikes
        status = self._servo.status[0]
        unheard = strikes - recorded.strikes.heard + strikes - heard.heard
        missing = recorded.strikes.missing + heard.missing + recorded.strikes.again + heard.again
        wrong = (
            abs(sound.duplicates - self._sound.brought_again) + abs(sound.played - strikes) + sound.refused
        )
        halted = int(status["status"] != PLAYING) + int(status["refused"]) + int(status["fault"] != 0)
        return [
            of_count("dropped", "events", int(cells[ring.DROPPED]), 0, "events that found the ring full"),
            of_count("unheard", "strikes", unheard, 0, "not heard by Zenoh or OSC"),
            of_count("numbers", "strikes", missing, 0, "out of order, missing or twice, by Zenoh or OSC"),
            of_count(
                "deduplication",
                "strikes",
                wrong,
                0,
                f"not once each, of {strikes} and {sound.duplicates} again",
            ),
            of_count(
                "recorded gaps", "messages", recorded.gaps.missing.total(), 0, "gaps that the recorder counts"
            ),
            of_count("servo", "faults", halted, 0, "not playing, a fault, or a set that the servo refused"),
            of_count(
                "clock map",
                "times",
                self._clocks.beyond,
                0,
                "that the clock map was further off than it says",
            ),
            of_count(
                "time line",
                "us",
                recorded.worst_ns / 1e3,
                1000.0,
                "of a recorded strike from its true instant",
            ),
            unjudged(
                "clock map error", "us", self._clocks.worst_error_ns / 1e3, "at worst, of the mapped clock"
            ),
            unjudged("time of day", "steps", float(self._gateway.visits), "of an hour, there and back"),
        ]


def growths(samples: Samples, speed: float) -> list[Verdict]:
    """Memory, descriptors, threads and the clock map's error, per virtual hour; at N times the rate N times as much."""
    bounds = (
        ("rss_kB", "kB", RSS_KB_PER_H),
        ("python_blocks", "blocks", BLOCKS_PER_H),
        ("descriptors", "descriptors", DESCRIPTORS_PER_H),
        ("threads", "threads", THREADS_PER_H),
        ("clock_error_us", "us", 1000.0),
    )
    return [
        of_growth(what, unit, *samples.series(WHO, what), bound * speed, BREATH_KB if unit == "kB" else 0.0)
        for what, unit, bound in bounds
    ]


def cycle_off_ns(minutes: int) -> float:
    """Distance of the default scene's strikes from the exact cycle in so many minutes, across the same limits."""
    servo = ticks.servo_of(parse(shipped_text("roll"), "roll"))
    minute = 60_000
    ticks.begin_at(servo, Counted(2**31 - minutes // 2 * minute, 2**32 - minutes // 2 * 1383))
    now, comb, out, worst = (
        (2**53 // 10**6 - minutes // 2 * minute) * 10**6,
        Comb(ticks.ROLL_HZ),
        ticks.room(),
        0.0,
    )
    newest = int(servo.tick_state["seq"][0])
    for _ in range(minutes):
        now = ticks.run(servo, minute, now)
        strikes = ticks.strikes_of(ticks.taken(servo, out), newest)
        newest += len(strikes)
        worst = max(
            worst, float(np.max(np.abs(comb.residuals_ns(strikes["seq"], strikes["t_ns"])), initial=0.0))
        )
    return worst


def soak(
    scene_text: str, span_s: float, speed: float, place: Path, samples: Samples, say: Callable[[str], None],
    stop: StopRequest, also: Take | None = None,
) -> Result:  # fmt: skip
    """The whole virtual form. Raises OSError when the disk is full."""
    virtual = Virtual(scene_text, place, span_s, also)
    try:
        virtual.run(samples, say, stop)
    finally:
        virtual.close()
    off_ns = cycle_off_ns(min(max(round(span_s / 60), 2), 60))
    verdicts = [
        *growths(samples, speed),
        *virtual.counted(),
        of_count("cycle", "ns", off_ns, _MAX_OFF_NS, "from the exact cycle of the default scene, at worst"),
    ]
    lasted_s = float(samples.series(WHO, "rss_kB")[0][-1] * 3600.0)
    return Result("virtual time", lasted_s, speed, virtual.strikes, virtual.strikes / lasted_s, verdicts)
