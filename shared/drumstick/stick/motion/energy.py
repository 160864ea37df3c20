"""Speed at z = 0 by energy, for a stick that is pulled far from the head and comes back slowly.

Where the hand lifts (or presses) much harder than the stick moves, a flight (or a contact) is nearly a full swing: at
its end the height is the small rest of a large one, and the speed found there keeps no more digits than that rest.

    e = z'^2 + w2 z^2 - 2 G z,   G = g + sum of p exp(-lam t),   de/dt = -4 a z'^2 + 2 sum of lam p exp(-lam t) z

is z'^2 at z = 0, and what changes it has no such rest: it is summed from z = 0 to z = 0, by Gauss and Legendre's rule
on the closed form. Relative error of the speed, while no force steps close to z = 0: below 1e-14 times one and its
condition number; of the instant 1e-13.
It is computed only where such a swing begins, until it arrives or turns back: it costs several times what the rest of a
tick does. Kernels: any thread; no allocation, no exceptions.
"""

import math

import numpy as np

from drumstick.stick.methods.carry import is_exact
from drumstick.stick.motion.crossing import Point
from drumstick.stick.motion.events import DESCENT, ENTRY, RELEASE
from drumstick.stick.records import Motion
from drumstick.stick.segment import (
    Segment,
    fastest_pulse_rate,
    propagate,
    pulse_acceleration_now,
    pulses_at_start,
)
from realtime.kernels.jit import njit

# Of the square of the swing's speed: more cannot be rounding, somebody has moved the stick meanwhile.
_ROUNDING = 1e-9
_POINTS = 16  # to 1e-16 of exp(-x) over 0 .. 16, and of a third of a swing
_RULE = np.polynomial.legendre.leggauss(_POINTS)  # on -1 .. 1
_NODES = tuple(0.5 + 0.5 * float(node) for node in _RULE[0])
_WEIGHTS = tuple(0.5 * float(weight) for weight in _RULE[1])


@njit()
def _swings(seg: Segment) -> bool:
    # From z = 0, drawn away from the head, with less speed than it will have on the way?
    if seg.a * seg.a >= seg.w2:
        return False
    w = math.sqrt(seg.w2)
    p0, p1, _, _, _ = pulse_acceleration_now(seg.pulses, 0.0)
    slowed = w * p0 - p1
    soon = p0 * p0 / slowed if slowed != 0.0 else 0.0  # m/s that pulses give before the swing has begun
    pull = seg.g + w * soon
    return pull * seg.v > 0.0 and abs(seg.v + soon) * w < abs(pull)


@njit()
def keep(motion: Motion, seg: Segment) -> None:
    """Begin to keep e where a swing starts, at z = 0; take over another equation, or pulse, elsewhere."""
    if not is_exact(seg):
        return
    if seg.z == 0.0:
        motion.energy_w2 = seg.w2 if _swings(seg) else 0.0
        motion.energy = seg.v * seg.v
    elif motion.energy_w2 > 0.0:
        pulled = seg.g + pulses_at_start(seg.pulses) - motion.energy_pull
        motion.energy += ((seg.w2 - motion.energy_w2) * seg.z - 2.0 * pulled) * seg.z
        motion.energy_w2 = seg.w2


@njit()
def _change(seg: Segment, t: float) -> float:
    # Of e in t seconds: no term of it takes digits from another, as those of its closed form would in a short tick.
    # Lengths double from the quickest pulse's own time on, up to a third of a swing.
    lam = fastest_pulse_rate(seg)
    if seg.a == 0.0 and lam == 0.0:
        return 0.0
    longest = 2.0 / math.sqrt(seg.w2)
    first = 1.0 / lam if lam > 0.0 else longest
    begin, change = 0.0, 0.0
    while begin < t:
        length = min(max(begin, first), longest, t - begin)
        for i in range(_POINTS):
            s = begin + _NODES[i] * length
            z, v, _ = propagate(seg, s)
            rate = pulse_acceleration_now(seg.pulses, s)[1]
            change -= _WEIGHTS[i] * length * (4.0 * seg.a * v * v + 2.0 * rate * z)
        begin += length
    return change


@njit()
def land(motion: Motion, seg: Segment, event: int, end: Point, span: float) -> Point:
    """The segment's end, at `span` s at the latest; where that is at z = 0, with the speed and instant that e says."""
    if not is_exact(seg) or not motion.energy_w2 > 0.0:
        return end
    if event == DESCENT and fastest_pulse_rate(seg) == 0.0:
        # Turned back below z = 0: e < 0, the swing never arrives. What lifts it out later acts on a height that
        # has lost these digits in any case.
        motion.energy_w2 = 0.0
        return end
    motion.energy += _change(seg, end.t)
    if event != ENTRY and event != RELEASE:
        return end
    slack = _ROUNDING * seg.g * seg.g / seg.w2
    if not (motion.energy > 0.0 and abs(motion.energy - end.v * end.v) <= slack and end.z2 != 0.0):
        return end
    v = math.copysign(math.sqrt(motion.energy), -1.0 if event == ENTRY else 1.0)
    t = min(max(end.t + (v - end.v) / end.z2, 0.0), span)
    return Point(t, 0.0, v, end.z2, end.z3, end.z4, end.z5, end.z6)
