"""One contact without pulses, the hand included: the rebound beta that equation (3) approximates, and its end.

With z_ss < 0 the hand presses the stick into the head, and below some entry speed it never leaves again: the capture
speed, at which a roll is dead. Any thread; blocks for microseconds (capture: some hundreds) once compiled.
"""

import math
from typing import NamedTuple

import numpy as np

from drumstick import exact
from drumstick.analysis import lap
from drumstick.analysis.unpulsed import scratch_of, unpulsed_law
from drumstick.scene import Scene
from realtime.jit import Record, Records, njit, only_with

# Entry speeds that are tried, in units of the speed at which the head's spring reaches as deep as the hand presses.
_SLOWEST, _FASTEST, _STEP = 1e-6, 1e60, 0.75
_HALVINGS = 200


class Rebound(NamedTuple):
    """beta = v_out / |v_in|; how long the contact lasts, s; the deepest point, m."""

    beta: float
    contact_s: float
    z_min_m: float


@njit()
def _strike(law: Record, scratch: Records, speed: float) -> int:
    scratch[0] = scratch[1]
    scratch[0].v = -speed
    return lap.until(law, scratch[0], exact.RELEASE, lap.LITTLE_PATIENCE, np.zeros(lap.TOLD_SIZE))[0]


def rebound(scene: Scene, v_m_per_s: float) -> Rebound | None:
    """The contact that begins at this downward speed; None when the stick never leaves the head, and for v <= 0."""
    if not v_m_per_s > 0.0:
        return None
    scratch = scratch_of(scene)
    if _strike(unpulsed_law(scene)[0], scratch, v_m_per_s) != exact.MOVING:
        return None
    motion = scratch[0]
    return Rebound(float(motion["v_out"] / v_m_per_s), float(motion["contact_s"]), float(motion["z_min"]))


@njit()
def _between(law: Record, scratch: Records, stays: float, leaves: float) -> float:
    # Bisection of the logarithm, then of the speed itself, down to neighbouring numbers.
    for _ in range(_HALVINGS):
        middle = math.sqrt(stays * leaves) if leaves > 2.0 * stays else 0.5 * (stays + leaves)
        if not stays < middle < leaves:
            break
        if _strike(law, scratch, middle) == exact.MOVING:
            leaves = middle
        else:
            stays = middle
    return leaves


@only_with("negative_damping", otherwise=0.0)
def _other_head_below(law: Record) -> float:
    return law.negative_damping.below


@njit()
def _capture(law: Record, scratch: Records, unit: float) -> float:
    # Up to an entry that leaves, then down to the first one that stays. 0: every one leaves, inf: none does.
    leaves = max(unit, 2.0 * _other_head_below(law))
    while _strike(law, scratch, leaves) != exact.MOVING:
        leaves *= 10.0
        if leaves > _FASTEST * unit:
            return math.inf
    while leaves > _SLOWEST * unit:
        slower = leaves * _STEP
        if _strike(law, scratch, slower) != exact.MOVING:
            return _between(law, scratch, slower, leaves)
        leaves = slower
    return 0.0


def capture_speed(scene: Scene) -> float | None:
    """The entry speed, m/s, below which a contact without pulses never ends; None when there is none.

    There is none when the hand does not press (z_ss >= 0), and none that is finite when no contact ever ends
    (an overdamped head that may pull, release = "paper"). Relative error below 1e-12, or 1e-17 over the damping ratio
    where that is larger: a head that loses nothing captures nothing. With `negative_damping`, whose slow contacts gain
    speed, it is the fastest entry that stays.
    """
    stick = scene.stick
    if stick.z_ss_m >= 0.0 or stick.k_hand_N_per_m == 0.0:
        return None
    stiffness = stick.k_hand_N_per_m + stick.k_coll_N_per_m
    pressed_m = -stick.k_hand_N_per_m * stick.z_ss_m / stiffness
    unit = pressed_m * math.sqrt(stiffness / stick.m_kg)
    speed = float(_capture(unpulsed_law(scene)[0], scratch_of(scene), unit))
    return speed if 0.0 < speed < math.inf else None
