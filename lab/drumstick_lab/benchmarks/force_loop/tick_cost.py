"""Cost of one tick of the force loop: drumstick lab tick-cost [--runs 25] [--ticks 10000].

The whole tick as the loop does it, in virtual time and with warm caches: orders, latch, physics or rendering and guard,
events, trace, status for the gateway; without the sleep. Scenes: the stick of `roll` without its effects, with them,
with all the alterations that the paper rejects; `cor-roll` and `delay-drum`; a sampled arm (`phantom`) that strokes,
without and with its pulse, and one that rests in its hand. On a stick also ticks in which a set waits for its moment.
And the judgement of a set by the envelope, which the tick makes once a revision.

Baselines in the same run, interleaved: one read of the clock, and the barest tick that plays the same scene: the exact
stick advanced and thrown again, or the arm carried, told and pushed by a spring; no parameters, events, guard or trace.
CPU time of the thread, so that others on the machine count for little.
"""

import argparse
import dataclasses
import math
import os
import re
import statistics
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from drumstick_lab.measuring import stored
from haptic_server import block as blocks
from haptic_server.servo import loop
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.simulation import phantom
from realtime.clock import now_ns
from realtime.kernels.jit import njit

TARGET_NS = 300.0  # of a tick without effects
_EVENTS_IN_A_TICK = 64
_WARM_TICKS = 2000
_TICKS_A_JUDGEMENT = 100  # so many fewer judgements than ticks are timed


def _without_effects(text: str) -> str:
    return re.sub(r"\[effects\.[^\[]*", "", text)


def scenes() -> dict[str, Scene]:
    """Scenes by the name that results show; a stick that has come to rest is thrown again soon, so that it does not idle."""
    again: dict[str, Any] = {"rest_s": 0.05}

    def played(name: str, effects: bool = True, plant: str = "stick", **hand: Any) -> Scene:
        text = shipped_text(name)
        found = parse(text if effects else _without_effects(text), name)
        device = dataclasses.replace(found.device, plant=plant)
        return dataclasses.replace(found, device=device, hand=dataclasses.replace(found.hand, **hand))

    return {
        "stick, no effects": played("roll", effects=False, **again),
        "stick, pulse": played("roll"),
        "stick, rejected alterations": played("rejected-by-the-paper", **again),
        "stick, cor-roll": played("cor-roll"),
        "stick, delay-drum": played("delay-drum"),
        "arm, at rest": played("phantom", False, "phantom", gesture="hold", rest_s=60.0),
        "arm, no effects": played("phantom", False, "phantom", gesture="strokes"),
        "arm, pulse": played("phantom", True, "phantom", gesture="strokes"),
    }


def servo_of(scene: Scene) -> Servo:
    device = Simulated(scene)
    block = blocks.in_memory(law_of(scene))
    return device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))


@njit()
def clock_reads(timespec: np.ndarray, times: int) -> int:
    last = 0
    for _ in range(times):
        last = now_ns(timespec)
    return last


@njit()
def bare_stick(
    law: np.ndarray, motion: np.ndarray, throw_m_per_s: float, period_s: float, ticks: int
) -> None:
    """The paper's stick alone, by the exact solution; thrown again when it has come to rest."""
    for _ in range(ticks):
        if motion[0].outcome != exact.MOVING:
            motion[0].outcome = exact.MOVING
            motion[0].contact_phase = exact.ABOVE
            motion[0].z = 0.0
            motion[0].v = throw_m_per_s
        moved = 0.0
        for _ in range(_EVENTS_IN_A_TICK):
            what, duration = exact.advance(law[0], motion[0], period_s - moved)
            moved += duration
            if what == exact.HORIZON:
                break


@njit()
def bare_arm(
    plant: np.ndarray, gesture: np.ndarray, path: np.ndarray, reading: np.ndarray, k_coll: float, ticks: int
) -> None:
    """The arm alone at 1 kHz, pushed by a spring in the head."""
    for tick in range(ticks):
        phantom.carry(plant[0], gesture[0], path, 1e-3, math.inf)
        phantom.measure(plant[0], reading[0], tick)
        phantom.apply_force(plant[0], -k_coll * min(reading[0].z_m, 0.0))


@njit()
def judgements(law: np.ndarray, limits: np.ndarray, scratch: np.ndarray, times: int) -> int:
    codes = 0
    for _ in range(times):
        codes += envelope.judge(law[0], limits[0], scratch).code
    return codes


class Case(NamedTuple):
    """One scene: how to make so many ticks or judgements of it, by what; each goes on where it stopped."""

    servo: Servo
    work: dict[str, Callable[[int], object]]


def case(scene: Scene) -> Case:
    """Both compiled and warm."""
    servo, spare, held = servo_of(scene), servo_of(scene), servo_of(scene)
    held.tick_state["is_pending"], held.tick_state["pending_max_entry_speed"] = (
        1,
        -1.0,
    )  # a set that passes, and never gets its moment
    held.pending_set["law"] = held.law
    now = {"whole": 0, "waiting": 0}

    def whole(ticks: int) -> None:
        now["whole"] = loop.run_virtual(servo, ticks, now["whole"])

    def waiting(ticks: int) -> None:
        now["waiting"] = loop.run_virtual(held, ticks, now["waiting"])

    def judging(times: int) -> None:
        judgements(servo.law, servo.envelope_limits, servo.scratch, max(times // _TICKS_A_JUDGEMENT, 1))

    def bare(ticks: int) -> None:
        if scene.device.plant == "phantom":
            k = float(spare.law["k_coll"][0])
            bare_arm(spare.plant, spare.gesture, spare.path, spare.reading, k, ticks)
        else:
            period_s = 1.0 / scene.servo.rate_Hz
            bare_stick(spare.law, spare.motion, scene.hand.throw_m_per_s, period_s, ticks)

    work: dict[str, Callable[[int], object]] = {"whole": whole, "bare": bare, "judging": judging}
    if scene.device.plant != "phantom":  # a set in the hand never waits above the head
        work["waiting"] = waiting
    for each in work.values():
        each(_WARM_TICKS)
    return Case(servo, work)


def ns_each(work: Callable[[int], object], times: int) -> float:
    """CPU time of this thread for each of `times`."""
    begun = time.thread_time_ns()
    work(times)
    return (time.thread_time_ns() - begun) / times


def interleaved(cases: dict[str, Case], runs: int, ticks: int) -> dict[str, dict[str, list[float]]]:
    """ns each, by case and by what (a part of the work, or a read of the clock), run by run."""
    timespec = np.zeros(2, np.int64)
    clock_reads(timespec, 1)
    found: dict[str, dict[str, list[float]]] = {
        name: {what: [] for what in (*each.work, "clock")} for name, each in cases.items()
    }
    for _ in range(runs):
        for name, each in cases.items():
            for what, work in each.work.items():
                found[name][what].append(ns_each(work, ticks))
            found[name]["judging"][-1] *= _TICKS_A_JUDGEMENT
            found[name]["clock"].append(ns_each(lambda n: clock_reads(timespec, n), ticks))
    return found


def _row(name: str, each: Case, ns: dict[str, list[float]], seconds: float) -> dict[str, Any]:
    least, median = ({what: of(values) for what, values in ns.items()} for of in (min, statistics.median))
    return {
        "ns": median["whole"],
        "least_ns": least["whole"],
        "bare_ns": median["bare"],
        "clock_read_ns": median["clock"],
        "judgement_ns": median["judging"],
        "waiting_ns": median.get("waiting"),
        "ratio_of_waiting": statistics.median(np.divide(ns["waiting"], ns["whole"]).tolist())
        if "waiting" in ns
        else None,
        "ratio_to_bare": statistics.median(np.divide(ns["whole"], ns["bare"]).tolist()),
        "ratio_to_clock_read": statistics.median(np.divide(ns["whole"], ns["clock"]).tolist()),
        "strikes_per_s": int(each.servo.tick_state["seq"][0]) / seconds,
        "fault": int(each.servo.tick_state["fault"][0]),
        "within_target": median["whole"] <= TARGET_NS if "no effects" in name else None,
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=25)
    parser.add_argument("--ticks", type=int, default=10_000)
    given = parser.parse_args()
    load = os.getloadavg()[0]
    cases = {name: case(scene) for name, scene in scenes().items()}
    found = interleaved(cases, given.runs, given.ticks)
    seconds = (_WARM_TICKS + given.runs * given.ticks) * 1e-3
    rows = {name: _row(name, cases[name], found[name], seconds) for name in cases}
    for name, row in rows.items():
        print(
            f"{name:28s} {row['ns']:6.0f} ns (least {row['least_ns']:.0f}), bare {row['bare_ns']:.0f},"
            f" clock {row['clock_read_ns']:.1f}; to bare {row['ratio_to_bare']:.2f},"
            f" to clock {row['ratio_to_clock_read']:.1f}; {row['strikes_per_s']:.1f} strikes/s;"
            f" a judgement {row['judgement_ns'] / 1e3:.1f} us"
            + (f", waiting {row['ratio_of_waiting']:.2f}" if row["ratio_of_waiting"] else "")
        )
    result = {"load_before": load, "target_ns": TARGET_NS, "rows": rows}
    stored.store("tick_cost", result)


if __name__ == "__main__":
    main()
