"""One contact without pulses, the hand included: the rebound beta that equation (3) approximates, and its end.

With z_ss < 0 the hand presses the stick into the head, and below some entry speed it never leaves again: the capture
speed, at which a roll is dead. Any thread; blocks for microseconds (capture: milliseconds) once compiled.
"""

import math
import sys
from typing import NamedTuple

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.unpulsed import repeating, unpulsed_law
from drumstick.parameters.scene import Scene
from drumstick.stick.effects.negative_damping import NegativeDamping
from drumstick.stick.law import thrown
from drumstick.stick.motion import exact

# Entry speeds that are tried, in units of the speed at which the head's spring reaches as deep as the hand presses.
_SLOWEST, _STEP = 1e-6, 0.75
_LEAST_UNIT_M_PER_S = sys.float_info.min / _SLOWEST  # from less, or from 0, the scan would never end
_FASTEST_M_PER_S = 9e5  # from 1e6 m/s on the exact motion counts a stick as gone
_HALVINGS = 200


class Rebound(NamedTuple):
    """beta = v_out / |v_in|; how long the contact lasts, s; the deepest point, m."""

    beta: float
    contact_s: float
    z_min_m: float


class _Head:
    # The scene's head, hit again and again without pulses.
    def __init__(self, scene: Scene) -> None:
        self._law = unpulsed_law(scene)[0]
        self._fresh = thrown(repeating(scene), 0.0)
        self.motion = self._fresh.copy()

    def returns(self, speed: float) -> bool:
        """True when a stick that comes down at this speed leaves the head again."""
        self.motion[0] = self._fresh[0]
        self.motion["v"] = -speed
        measured = np.zeros(return_step.MEASURED_SIZE)
        outcome, _ = return_step.until(
            self._law, self.motion[0], exact.RELEASE, return_step.FEW_WAIT_DOUBLINGS, measured
        )
        return outcome == exact.MOVING


def rebound(scene: Scene, v_m_per_s: float) -> Rebound | None:
    """The contact that begins at this downward speed; None when the stick never leaves the head, and for v <= 0."""
    head = _Head(scene)
    if not (v_m_per_s > 0.0 and head.returns(v_m_per_s)):
        return None
    motion = head.motion[0]
    return Rebound(float(motion["v_out"] / v_m_per_s), float(motion["contact_s"]), float(motion["z_min"]))


def _between(head: _Head, stays: float, leaves: float) -> float:
    # Bisection of the logarithm, then of the speed itself, down to neighbouring numbers.
    for _ in range(_HALVINGS):
        middle = math.sqrt(stays * leaves) if leaves > 2.0 * stays else 0.5 * (stays + leaves)
        if not stays < middle < leaves:
            break
        if head.returns(middle):
            leaves = middle
        else:
            stays = middle
    return leaves


def _slowest_that_leaves(head: _Head, unit: float, fastest_odd: float) -> float | None:
    # Up to an entry that leaves, then down to the first one that stays; None when every one leaves, or none does.
    leaves = max(unit, 2.0 * fastest_odd)
    while not head.returns(leaves):
        leaves *= 10.0
        if leaves > _FASTEST_M_PER_S:
            return None
    while leaves > _SLOWEST * unit:
        slower = leaves * _STEP
        if not head.returns(slower):
            return _between(head, slower, leaves)
        leaves = slower
    return None


def capture_speed(scene: Scene) -> float | None:
    """The entry speed, m/s, below which a contact without pulses never ends; None when there is none.

    There is none when the hand does not press (z_ss >= 0, or so little below it that the speed is no normal number),
    and none below 1e6 m/s when no contact ever ends (an overdamped head that may pull, release = "paper"). Relative
    error below 1e-12, or 1e-17 over the damping ratio where that is larger: a head that loses nothing captures nothing.
    With `negative_damping`, whose slow contacts gain speed, it is the fastest entry that stays.
    """
    stick = scene.stick
    if stick.z_ss_m >= 0.0 or stick.k_hand_N_per_m == 0.0:
        return None
    stiffness = stick.k_hand_N_per_m + stick.k_coll_N_per_m
    pressed_m = -stick.k_hand_N_per_m * stick.z_ss_m / stiffness
    unit = pressed_m * math.sqrt(stiffness / stick.m_kg)
    if unit < _LEAST_UNIT_M_PER_S:
        return None
    other: NegativeDamping | None = scene.effects.get("negative_damping")
    odd = other.below_m_per_s if other and other.where == "inside" else 0.0
    return _slowest_that_leaves(_Head(scene), unit, odd)
