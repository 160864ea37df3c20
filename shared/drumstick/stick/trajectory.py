"""The motion itself, sampled densely: for figures of the phase plane and of the force. Any thread; blocks.

Every sample is the exact solution at its time; what lies between two samples was computed too, events included,
so a coarse grid is sparse but never wrong.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.motion.transitions import force_now
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit

Samples = npt.NDArray[np.float64]


class Trajectory(NamedTuple):
    """Arrays of shape (points,): time (s), height (m), speed (m/s, up is positive), head's force on the stick (N)."""

    t_s: Samples
    z_m: Samples
    v_m_per_s: Samples
    force_N: Samples


@njit()
def _carry(law: Law, motion: Motion, duration: float) -> None:
    # A stick that came to its end moves on: it swings into its rest in the head, or about it far above.
    gone = 0.0
    while gone < duration:
        _, moved = exact.advance(law, motion, duration - gone)
        gone += moved
        if moved == 0.0 and motion.outcome == exact.CAPTURED:
            return  # it lies on the head: the same event for ever


@njit()
def _sample(law: Law, motion: Motion, steps: Samples, z: Samples, v: Samples, force: Samples) -> None:
    for i in range(z.shape[0]):
        _carry(law, motion, steps[i])
        z[i] = motion.z
        v[i] = motion.v
        force[i] = force_now(law, motion)


def trajectory(scene: Scene, v0_m_per_s: float, duration_s: float, points: int) -> Trajectory:
    """The stick thrown from z = 0+ with `v0_m_per_s` >= 0: `points` >= 2 equal steps over `duration_s`."""
    return onward(law_of(scene), thrown(scene, v0_m_per_s), duration_s, points)


def onward(law: Records, motion: Records, duration_s: float, points: int) -> Trajectory:
    """Like `trajectory`, from any motion; law and motion: shape (1,), the motion is carried along."""
    if points < 2 or not 0.0 < duration_s < np.inf:
        raise ValueError(
            f"{points} points over {duration_s} s: give 2 points or more and a duration above 0 s"
        )
    steps = np.full(points, duration_s / (points - 1))
    steps[0] = 0.0
    return Trajectory(np.linspace(0.0, duration_s, points), *carried(law, motion, steps))


def carried(law: Records, motion: Records, steps_s: Samples) -> tuple[Samples, Samples, Samples]:
    """Height, speed and force after each of these steps (s, from 0), shape (points,); the motion is carried along."""
    z, v, force = np.empty_like(steps_s), np.empty_like(steps_s), np.empty_like(steps_s)
    _sample(law[0], motion[0], steps_s, z, v, force)
    return z, v, force
