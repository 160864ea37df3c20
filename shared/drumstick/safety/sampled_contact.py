"""Contact of a sampled arm with a rendered head: when it is stable, and what it gives back of a blow.

The arm tells its position at ticks, the law computes -K (z + lead v) - R v from it, with v the difference over a window
of n ticks, and the motors hold that force from d ticks later on for one tick. With the hand's spring and damper on the
arm, between ticks z'' + 2 a z' + w^2 z = F/m is known in closed form, so the pulse-transfer function is exact:

    G(q) = (1/m) (g q + S^2 - g S') / (q^2 - (C + S') q + C S' + w^2 S^2)        g = integral of S over the tick
    F/z  = -[(K + B/(n T)) q^n - B/(n T)] / q^(n + d),                            B = R + K lead

Its poles are the roots of a polynomial of degree n + d + 2, tested for lying inside the unit circle by the Schur-Cohn
recursion. Without window, delay and hand that is the linear boundary of Gil, Avello, Rubio and Florez (IEEE Trans.
Control Systems Technology 12, 2004) and, with delay, of Hulin, Preusche and Hirzinger (IROS 2006). It bounds R from
both sides: a rendered damper comes late itself, and with too much of it the held force outlives the motion that it
answers. That is weaker than passivity, b > K T/2 + |B| with the arm's own damping b (Colgate and Schenkel, J. Robotic
Systems 14, 1997), which no arm without damping of its own fulfils.

A head only pushes, so a blow may come back faster than it came though the poles are stable: `rebound` plays one blow at
several phases of the tick, and a slow one at several phases of the encoder's count. Kernels: any thread; no allocation.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.rig import MAX_DELAY_TICKS
from drumstick.stick import contact
from drumstick.stick.contact import PAPER
from drumstick.stick.segment import free_response
from realtime.kernels.jit import njit

MAX_WINDOW = 15  # ticks; the servo keeps 16 positions
# Of a blow's speed; the rest of 1 is for what the model leaves out: encoder counts, and the motors' limit.
MAX_REBOUND = 0.92
# An arm at rest hunts by a count or two. So what one count changes of its speed by way of the damper in a tick, and how
# fast it swings by one count on the head's spring, have limits, m/s; with these no arm was seen to hunt faster than
# 0.01 m/s (drumstick lab held-arm).
MAX_VELOCITY_STEP_M_PER_S = 0.00046
# So much less for each tick of delay, since a late push goes on when the reading has flipped back long ago.
VELOCITY_STEP_SHARE_PER_DELAY_TICK = 0.06
MAX_OSCILLATION_M_PER_S = 0.00705
# And a blow as slow as that, seen in counts, must come back slower, whatever the phases of tick and count that are
# tried: the rest of 1 is for those that are not.
SLOW_M_PER_S = 0.01
MAX_SLOW_REBOUND = 0.95
# So that few sets fail in this, the head holds back that share of its push while such a blow leaves it: of one up to
# SLOW_REBOUND_REDUCTION_M_PER_S, fading to none at twice that, a tenth of the quietest stroke that a player means.
SLOW_REBOUND_REDUCTION, SLOW_REBOUND_REDUCTION_M_PER_S = 0.2, 0.02
_LIVELY, _MAX_OWN = 1.01, 0.98
_PHASES = 6  # of the tick, in which a blow is tried
_SLOW_PHASES, _COUNT_PHASES = 2, 4  # of the tick and of the count, in which a slow one is
# Of SLOW_M_PER_S; and of the way from the lightest arm to the heaviest: counts favour some speeds, and some masses.
_SLOW_SPEEDS, _SLOW_MASSES = (0.97, 1.0, 1.03, 1.06, 1.1), (0.0, 0.5, 1.0)
SCRATCH_SIZE = MAX_WINDOW + MAX_DELAY_TICKS + 3
_INSIDE = 1.0 - 1e-9
_MAX_TICKS = 400  # of a blow that is played
_AT_REST_TICKS = 250  # then an arm that stays in the head moves by counts alone, or slowly

Coefficients = npt.NDArray[np.float64]


class Arm(NamedTuple):
    """The arm in its hand, and how it is sampled: kg, N/m, N s/m, s, ticks, s."""

    m: float
    k_hand: float
    r_hand: float
    period_s: float
    delay_ticks: int
    lead_s: float


class Head(NamedTuple):
    """Rendered head: K N/m, its own damping R = R_in - R_out N s/m, and the rule of release."""

    k: float
    r: float
    release: int


@njit()
def _held(arm: Arm, c: float) -> float:
    # g, the integral of S over a tick; (1 - C)/w^2 cancels where the hand is soft.
    bend = arm.k_hand / arm.m * arm.period_s * arm.period_s
    return (1.0 - c) * arm.period_s * arm.period_s / bend if bend > 1e-6 else 0.5 * arm.period_s**2


@njit()
def _inside_unit_circle(c: Coefficients, degree: int) -> bool:
    # Schur-Cohn: are all roots of c[0] q^degree + ... + c[degree] inside? c is used up. A NaN fails.
    for last in range(degree, 0, -1):
        reflection = c[last] / c[0]
        if not abs(reflection) < _INSIDE:
            return False
        for low in range((last + 1) // 2):
            high = last - low
            first, second = c[low], c[high]
            c[low] = first - reflection * second
            c[high] = second - reflection * first
        if last % 2 == 0:
            c[last // 2] -= reflection * c[last // 2]
    return True


@njit()
def is_stable(arm: Arm, head: Head, window: int, scratch: Coefficients) -> bool:
    """True when the arm that stays in the head comes to rest, with its speed taken over `window` ticks.

    `scratch`: shape (SCRATCH_SIZE,), written to.
    """
    a, w2 = 0.5 * arm.r_hand / arm.m, arm.k_hand / arm.m
    c, s, s_rate = free_response(a, w2, arm.period_s)
    g = _held(arm, c)
    lifted = s * s - g * s_rate
    damper = (head.r + head.k * arm.lead_s) / (window * arm.period_s)
    degree = window + arm.delay_ticks + 2
    for at in range(degree + 1):
        scratch[at] = 0.0
    scratch[0] = 1.0
    scratch[1] = -(c + s_rate)
    scratch[2] = c * s_rate + w2 * s * s
    # (g q + lifted) ((k + damper) q^window - damper)/m, from the lowest power up.
    spring = (head.k + damper) / arm.m
    scratch[degree] -= lifted * damper / arm.m
    scratch[degree - 1] -= g * damper / arm.m
    scratch[degree - window] += lifted * spring
    scratch[degree - window - 1] += g * spring
    return _inside_unit_circle(scratch, degree)


@njit()
def slow_rebound_reduction(reduction: float, z_before: float, v_before: float, z: float, v: float) -> float:
    """The share of its push that the head holds back while this blow leaves it (v >= 0), as z m and v m/s are seen.

    Found as it comes in, and gone as soon as it sinks again: an arm that is held down keeps the whole push. v_before:
    the last speed that was not 0; between two counts a slow arm seems to stand.
    """
    if z < 0.0 <= z_before:
        return SLOW_REBOUND_REDUCTION * min(max(2.0 - abs(v) / SLOW_REBOUND_REDUCTION_M_PER_S, 0.0), 1.0)
    return 0.0 if v < 0.0 < v_before else reduction


class Impact(NamedTuple):
    """A blow as the encoders tell it: m/s; share of a tick that it begins after one; a count, m, and the share of one.

    count_m 0: encoders without counts.
    """

    speed: float
    phase: float
    count_m: float
    offset: float


@njit()
def _encoded(blow: Impact, per_m: float, z: float) -> float:
    return blow.count_m * math.floor(z * per_m + blow.offset) if blow.count_m > 0.0 else z


@njit()
def rebound(arm: Arm, head: Head, window: int, blow: Impact, scratch: Coefficients) -> float:
    """Speed that the arm leaves with over the speed of its blow.

    Of one that does not come out: what it still moves at by encoder counts, 0 without counts. `scratch`: shape
    (SCRATCH_SIZE,), written to: its positions at the last ticks, and the forces that are on their way.
    """
    a, w2 = 0.5 * arm.r_hand / arm.m, arm.k_hand / arm.m
    c, s, s_rate = free_response(a, w2, arm.period_s)
    g = _held(arm, c)
    period = arm.period_s
    z, v = blow.phase * period * blow.speed + blow.count_m, -blow.speed
    places, arriving = window + 1, window + 1 + arm.delay_ticks
    newest, oldest, due = 0, 1, places
    per_s, per_m = 1.0 / (window * period), 1.0 / blow.count_m if blow.count_m > 0.0 else 0.0
    back, on, push = -w2 * s, g / arm.m, s / arm.m
    for ago in range(places):
        scratch[(places - ago) % places] = _encoded(blow, per_m, z + ago * period * blow.speed)
    for tick in range(arm.delay_ticks):
        scratch[places + tick] = 0.0
    touching, hunting, idle = False, 0.0, 0  # idle: ticks since a force was reckoned
    reduction, seen_before, speed_before = 0.0, 0.0, 0.0
    for tick in range(_MAX_TICKS):
        reading_m = scratch[newest]
        speed = (reading_m - scratch[oldest]) * per_s
        seen = reading_m + arm.lead_s * speed
        # As the servo sees it: a contact ends above two counts, for a stick that lies on the head must not chatter, but
        # a head acts below z = 0 only.
        if blow.count_m > 0.0:
            reduction = slow_rebound_reduction(reduction, seen_before, speed_before, seen, speed)
            seen_before = seen
            if speed != 0.0:
                speed_before = speed
        touching = seen <= 2.0 * blow.count_m if touching else seen < 0.0
        force = 0.0
        if touching and seen < 0.0:
            force = -head.k * seen - head.r * speed
            if head.release != PAPER:
                force = max(force, 0.0)
            if speed >= 0.0:
                force *= 1.0 - reduction
        idle = 0 if force != 0.0 else idle + 1
        if arm.delay_ticks > 0:
            force, scratch[due] = scratch[due], force
            due = due + 1 if due + 1 < arriving else places
        if z > 0.0 and v > 0.0 and not touching and idle > arm.delay_ticks:
            return v / blow.speed
        z, v = c * z + s * v + on * force, back * z + s_rate * v + push * force
        newest = oldest
        oldest = oldest + 1 if oldest + 1 < places else 0
        scratch[newest] = _encoded(blow, per_m, z)
        if tick > _AT_REST_TICKS:
            hunting = max(hunting, abs(v))
    return hunting / blow.speed if blow.count_m > 0.0 else 0.0


@njit()
def worst_rebound(arm: Arm, head: Head, window: int, scratch: Coefficients) -> float:
    """The largest rebound of all phases of the tick that are tried."""
    worst = 0.0
    for phase in range(_PHASES):
        blow = Impact(1.0, (phase + 0.5) / _PHASES, 0.0, 0.0)
        worst = max(worst, rebound(arm, head, window, blow, scratch))
    return worst


@njit()
def slow_rebound(
    lightest: Arm, heaviest: Arm, head: Head, window: int, resolution_m: float, scratch: Coefficients
) -> float:
    """The largest rebound of a blow of about SLOW_M_PER_S that is seen in encoder counts, in no hand.

    Ends at the first that is above MAX_SLOW_REBOUND.
    """
    worst = 0.0
    for way in _SLOW_MASSES:
        m = lightest.m * (heaviest.m / lightest.m) ** way
        arm = Arm(m, 0.0, 0.0, lightest.period_s, lightest.delay_ticks, lightest.lead_s)
        for share in _SLOW_SPEEDS:
            for phase in range(_SLOW_PHASES):
                for offset in range(_COUNT_PHASES):
                    tick_phase, count_phase = (phase + 0.5) / _SLOW_PHASES, (offset + 0.5) / _COUNT_PHASES
                    blow = Impact(share * SLOW_M_PER_S, tick_phase, resolution_m, count_phase)
                    worst = max(worst, rebound(arm, head, window, blow, scratch))
                    if not worst <= MAX_SLOW_REBOUND:
                        return worst
    return worst


@njit()
def most_rebound(arm: Arm, head: Head) -> float:
    """The largest rebound that is let pass: MAX_REBOUND, or a lively head's own, which is not the lag's doing."""
    own = contact.beta(head.release, arm.m, head.k, head.r) if head.r >= 0.0 else 1.0
    return max(MAX_REBOUND, min(own * _LIVELY, _MAX_OWN))


@njit()
def _gives_back_less(lightest: Arm, heaviest: Arm, head: Head, window: int, scratch: Coefficients) -> bool:
    if not worst_rebound(lightest, head, window, scratch) < most_rebound(lightest, head):
        return False
    return worst_rebound(heaviest, head, window, scratch) < most_rebound(heaviest, head)


@njit()
def widest_window(lightest: Arm, heaviest: Arm, head: Head, scratch: Coefficients) -> int:
    """Ticks of the longest window with which every blow comes back slower and the arm in the head comes to rest.

    0 when there is none. Both ends of the range of masses, in the stiffest grip and in none, and every shorter window.
    """
    stable = 0
    for window in range(1, MAX_WINDOW + 1):
        for arm in (lightest, heaviest):
            free = Arm(arm.m, 0.0, 0.0, arm.period_s, arm.delay_ticks, arm.lead_s)
            if not (is_stable(arm, head, window, scratch) and is_stable(free, head, window, scratch)):
                break
        else:
            stable = window
            continue
        break
    # A longer window is later, so what comes back grows with it.
    if stable == 0 or not _gives_back_less(lightest, heaviest, head, 1, scratch):
        return 0
    low, high = 1, stable + 1
    while high - low > 1:
        middle = (low + high) // 2
        if _gives_back_less(lightest, heaviest, head, middle, scratch):
            low = middle
        else:
            high = middle
    return low


@njit()
def velocity_step_per_count(arm: Arm, head: Head, window: int, resolution_m: float) -> float:
    """Change of the arm's speed in a tick by one encoder count by way of the damper, m/s."""
    return (head.r + head.k * arm.lead_s) * resolution_m / (window * arm.m)


@njit()
def max_velocity_step_per_count(delay_ticks: int) -> float:
    """The most that one encoder count may change of an arm's speed in a tick, m/s, when its force is so late."""
    return MAX_VELOCITY_STEP_M_PER_S / (1.0 + VELOCITY_STEP_SHARE_PER_DELAY_TICK * delay_ticks)


@njit()
def oscillation_speed_per_count(arm: Arm, head: Head, resolution_m: float) -> float:
    """The speed of an arm that swings by one encoder count on the head's spring, m/s."""
    return math.sqrt(head.k / arm.m) * resolution_m
