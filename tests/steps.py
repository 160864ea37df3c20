"""Cost of one step: scenes with 0, 1 and 3 effects by the composed kernels and by the loops of `plain_steps`.

Both do the same steps of semi-implicit Euler without event location. The step is a power of two, so that sums of steps
are exact and none is cut short. Windows are CPU time of the thread, to be measured in turn.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import plain_steps
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.hysteretic_spring import HystereticSpring
from drumstick.stick.effects.negative_damping import NegativeDamping
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.methods.carry import STEPPERS
from drumstick.stick.motion import exact, stepping
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit

DT_S = 2.0**-17  # 7.6 µs
STEPS = 100_000  # 0.76 s of motion, about a millisecond of computing
THROW_M_PER_S = 0.4
METHOD = STEPPERS["semi_implicit_euler"]

Plain = Callable[[int], tuple[float, float, plain_steps.Blow]]


@njit()
def _composed(law: Law, motion: Motion, method: int, dt: float, steps: int) -> None:
    left = dt * steps
    while left > 0.0 and motion.outcome == exact.MOVING:
        left -= stepping.unlocated(law, motion, left, method, dt)[1]


class Race(NamedTuple):
    """One scene, and the loop written for it, which takes the number of steps."""

    words: str
    scene: Scene
    plain: Plain

    def composed(self, steps: int) -> Records:
        """The motion after so many steps by the composed kernels."""
        law, motion = law_of(self.scene), thrown(self.scene, THROW_M_PER_S)
        _composed(law[0], motion[0], METHOD, DT_S, steps)
        return motion


def _numbers(stick: Stick) -> plain_steps.Stick:
    return plain_steps.Stick(
        stick.m_kg,
        stick.k_coll_N_per_m,
        stick.r_in_N_s_per_m,
        stick.k_hand_N_per_m,
        stick.r_out_N_s_per_m,
        stick.z_ss_m,
    )


def _races() -> dict[int, Race]:
    # Without a pulse only an undamped stick does not come to rest.
    damped, undamped = (Stick(0.015, 5000.0, r, 20.0, r / 13.0, -0.02, "paper") for r in (1.3, 0.0))
    pulse, spring, damper = Pulse(0.2, 0.002, "exit"), HystereticSpring(1.2), NegativeDamping(1.0, 0.5)
    lowered = damped.r_in_N_s_per_m - damper.r_N_s_per_m
    effects = {"pulse": pulse, "hysteretic_spring": spring, "negative_damping": damper}

    def none(steps: int) -> tuple[float, float, plain_steps.Blow]:
        return plain_steps.none(_numbers(undamped), 0.0, THROW_M_PER_S, DT_S, steps)

    def one(steps: int) -> tuple[float, float, plain_steps.Blow]:
        numbers = _numbers(damped)
        return plain_steps.pulsed(numbers, pulse.dv_m_per_s, pulse.tau_s, 0.0, THROW_M_PER_S, DT_S, steps)

    def three(steps: int) -> tuple[float, float, plain_steps.Blow]:
        numbers, given = _numbers(damped), (pulse.dv_m_per_s, pulse.tau_s, spring.ratio)
        return plain_steps.altered(
            numbers, *given, lowered, damper.below_m_per_s, 0.0, THROW_M_PER_S, DT_S, steps
        )

    return {
        0: Race("no effect", Scene("none", stick=undamped, effects={}), none),
        1: Race("`pulse`", Scene("one", stick=damped, effects={"pulse": pulse}), one),
        3: Race(
            "`pulse`, `hysteretic_spring`, `negative_damping`",
            Scene("three", stick=damped, effects=effects),
            three,
        ),
    }


RACES = _races()


def composed_window(scene: Scene) -> float:
    """CPU seconds a step took by the composed kernels."""
    law, motion = law_of(scene), thrown(scene, THROW_M_PER_S)
    begun = time.thread_time()
    _composed(law[0], motion[0], METHOD, DT_S, STEPS)
    spent = time.thread_time() - begun
    assert motion["outcome"][0] == exact.MOVING
    return spent / STEPS


def plain_window(plain: Plain) -> float:
    """CPU seconds a step took by a loop written by hand."""
    begun = time.thread_time()
    plain(STEPS)
    return (time.thread_time() - begun) / STEPS
