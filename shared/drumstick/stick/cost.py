"""Cost of a scene's stick a tick on this machine, and the accuracy that a stepper's step buys.

Any thread; blocks while it computes. Times are CPU time of the calling thread.
"""

import dataclasses
import time
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from drumstick.stick.simulate import COLUMNS, Stepper, simulate
from realtime.kernels.jit import njit

_COMPARED = 10  # contacts
_T_IN = COLUMNS.index("t_in_s")


@njit()
def _ticks(law: Law, motion: Motion, throw: float, ticks: int, period_s: float) -> int:
    # As the servo does it: tick by tick, and a stick that lies dead or has left is thrown again.
    contacts = 0
    for _ in range(ticks):
        if motion.outcome != exact.MOVING:
            motion.outcome = exact.MOVING
            motion.contact_phase = exact.ABOVE
            motion.z = 0.0
            motion.v = throw
        moved = 0.0
        while moved < period_s and motion.outcome == exact.MOVING:
            event, duration = exact.advance(law, motion, period_s - moved)
            moved += duration
            if event == exact.RELEASE:
                contacts += 1
            if event == exact.HORIZON:
                break
    return contacts


class TickCost(NamedTuple):
    """Mean CPU time of a tick, and how many contacts a simulated second had."""

    ns: float
    contacts_per_s: float


def tick_cost(scene: Scene, ticks: int) -> TickCost:
    """Advance the scene's stick by `ticks` ticks of its servo by `exact`."""
    law, motion = law_of(scene), thrown(scene, scene.hand.throw_m_per_s)
    period_s = 1.0 / scene.servo.rate_Hz
    throw = scene.hand.throw_m_per_s
    _ticks(law[0], motion[0], throw, ticks, period_s)
    begun = time.thread_time_ns()
    contacts = _ticks(law[0], motion[0], throw, ticks, period_s)
    return TickCost((time.thread_time_ns() - begun) / ticks, contacts / (ticks * period_s))


def without(scene: Scene, effect: str) -> Scene:
    """The scene less one effect."""
    return dataclasses.replace(scene, effects={k: v for k, v in scene.effects.items() if k != effect})


class StepperCost(NamedTuple):
    """CPU time a simulated second, and the largest error of the first ten contacts' times against `exact`, s."""

    ns_per_s: float
    error_s: float


def _first(contacts: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return contacts[:_COMPARED, _T_IN]


def stepper_cost(scene: Scene, stepper: Stepper | None, duration_s: float) -> StepperCost:
    """Play the scene for `duration_s`; None is `exact` itself, whose error here is 0 by definition."""
    throw = scene.hand.throw_m_per_s
    reference = _first(simulate(scene, duration_s, throw).contacts)
    simulate(scene, duration_s, throw, stepper)
    begun = time.thread_time_ns()
    contacts = simulate(scene, duration_s, throw, stepper).contacts
    spent = time.thread_time_ns() - begun
    found = _first(contacts)
    if len(found) < len(reference):
        return StepperCost(spent / duration_s, float("inf"))
    error = np.abs(found[: len(reference)] - reference)
    return StepperCost(spent / duration_s, float(error.max(initial=0.0)))
