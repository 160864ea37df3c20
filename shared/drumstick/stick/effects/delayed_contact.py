"""One blow on a head that is computed late (drumstick.stick.effects.system_delay), at its worst phase.

The stick moves freely between the samples, so its motion from one to the next is known in closed form: the same
arithmetic as the kernels', written for one contact. Kernels: any thread; no allocation.
"""

import math
from typing import Protocol

from drumstick.stick import contact
from drumstick.stick.contact import PAPER
from drumstick.stick.records import Law
from realtime.kernels.jit import njit

MAX_TICKS = 8
_MAX_PHASES, _MIN_PHASES = 32, 4  # of the sampling, tried for the worst; few where samples lie close
_STARTS = 500  # phases times samples a contact
_FINE_SAMPLES, _SHORT_LAGS = (
    60,
    40,
)  # a contact of more samples, and so many lags, is bounded by its lag alone
_HALF_TURNS = 4  # a contact that lasts longer creeps out, or swings without getting out
_NOTHING_LATE: tuple[float, ...] = (0.0,) * (MAX_TICKS + 1)
_MARGIN = 1.02  # between the phases tried, and for the lag's next order
_STUCK = 0.5  # of the entry speed: what is left of a stick that creeps out of the head


class Sampling(Protocol):
    """Time between samples, s, and how many samples late they come."""

    period: float
    delay_ticks: int


@njit()
def _drift(w: float, t: float) -> tuple[float, float, float]:
    # z'' = -w^2 z + a: what z, v and a at the start make of z after t, as C, S and G; v follows from their rates.
    if w == 0.0:
        return 1.0, t, 0.5 * t * t
    half = math.sin(0.5 * w * t)
    return math.cos(w * t), math.sin(w * t) / w, 2.0 * half * half / (w * w)


@njit()
def _head(law: Law, r: float, ratio: float, z: float, v: float) -> float:
    if z >= 0.0:
        return 0.0
    push = -law.k_coll * (ratio if v > 0.0 else 1.0) * z - (r - law.r_out) * v
    return push if law.release == PAPER else max(push, 0.0)


@njit()
def _later(late: tuple[float, ...], newest: float) -> tuple[float, ...]:
    return (newest,) + late[:-1]  # noqa: RUF005  numba joins tuples, but does not unpack them


@njit()
def _leaving(law: Law, z: float, v: float, a: float, pressing: float) -> float:
    # The speed at z = 0 of a stick at z <= 0, or that it had there at z > 0, while the force does not change.
    w2 = law.k_hand / law.m
    return math.sqrt(max(v * v + w2 * z * z + 2.0 * (pressing - a) * z, 0.0))


@njit()
def _from(
    law: Law, sampling: Sampling, r: float, ratio: float, wait: float, u: float, pressing: float, samples: int
) -> tuple[float, float]:
    # Entry at u m/s with the hand pressing with a constant acceleration besides its spring; the first
    # sample comes `wait` seconds later. The largest speed at z = 0 until no force is left, and the largest force, N. A
    # stick that lies on the head, u = 0, may swing in it: the last turn before it is out begins at z = 0 at most.
    period, ticks = sampling.period, int(sampling.delay_ticks)
    w = math.sqrt(law.k_hand / law.m)
    turning = math.sqrt((law.k_coll + law.k_hand) / law.m)
    rest = -pressing / (turning * turning)
    c, s, g = _drift(w, wait)
    z, v = -s * u - g * pressing, -c * u - s * pressing
    c, s, g = _drift(w, period)
    late = _NOTHING_LATE
    peak, grown, fastest = 0.0, 0.0, 0.0
    before = math.hypot(u, rest * turning)
    rising = False
    for _ in range(samples):
        late = _later(late, _head(law, r, ratio, z, v))
        a = late[ticks] / law.m
        peak = max(peak, abs(late[ticks]))
        coming = abs(late[ticks])
        for tick in range(ticks):
            coming += abs(late[tick])
        if z >= 0.0 and v > 0.0 and coming == 0.0:
            fastest = max(fastest, _leaving(law, z, v, 0.0, pressing))
            if u > 0.0:
                return fastest, peak
            grown = max(grown, math.hypot(fastest, rest * turning) / before)
            break
        if u == 0.0 and rising and v <= 0.0:
            now = math.hypot(v, (z - rest) * turning)
            grown = max(grown, now / before)
            before = now
        rising = v > 0.0
        z_next, v_next = c * z + s * v + g * (a - pressing), -w * w * s * z + c * v + s * (a - pressing)
        if z < 0.0 and z_next >= 0.0:
            fastest = max(fastest, _leaving(law, z, v, a, pressing))
        z, v = z_next, v_next
    if u == 0.0:
        return abs(rest) * turning * math.sqrt(max(grown * grown - 1.0, 0.0)), peak * max(grown, 1.0)
    creeping = math.hypot(v, z * math.sqrt(law.k_coll / law.m))
    return (max(fastest, creeping), peak) if creeping < _STUCK * u else (math.inf, peak)


@njit()
def _by_lag(
    law: Law, sampling: Sampling, r: float, ratio: float, pressing: float
) -> tuple[float, float, float, float]:
    # Many samples a contact: e^(-s lag) = 1 - s lag + s^2 lag^2/2 - s^3 lag^3/6 with s^2 = -w^2 makes of spring and
    # damper others, without lag; the phase is of no account.
    lag = sampling.period * (0.5 + sampling.delay_ticks)
    stiffest = law.k_coll * ratio
    m = law.m - r * lag + 0.5 * stiffest * lag * lag
    w2 = stiffest / m
    left = r - stiffest * lag - w2 * lag * lag * (0.5 * r - stiffest * lag / 6.0)
    spring = math.sqrt(m * stiffest)
    if left <= -spring:
        return math.inf, math.inf, math.inf, math.inf
    zeta = 0.5 * left / spring
    own = contact.beta(law.release, m, stiffest, left) if left >= 0.0 else 0.0
    if left < 0.0:
        own = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))
    grown = _MARGIN * max(own, 1.0)
    speed = pressing * math.sqrt(law.m / law.k_coll)
    force_per_speed = (
        max(spring, math.sqrt(law.m * stiffest))
        * math.hypot(1.0, (abs(r) + law.r_out) / spring)
        * grown
        * grown
    )
    added_speed = speed * math.sqrt(max(grown**4 * (4.0 * ratio - 3.0) - 1.0, 0.0))
    return _MARGIN * own * math.sqrt(ratio), added_speed, force_per_speed, 2.0 * force_per_speed * speed


@njit()
def _by_phase(
    law: Law, sampling: Sampling, r: float, ratio: float, half_turn: float, pressing: float
) -> tuple[float, float, float, float]:
    # Sample by sample, at every phase.
    period = sampling.period
    each = half_turn / period
    phases = min(max(int(_STARTS / each), _MIN_PHASES), _MAX_PHASES)
    samples = int(_HALF_TURNS * each) + 2 * MAX_TICKS
    restitution, added_speed, force_per_speed, static_force = 0.0, 0.0, 0.0, 0.0
    for phase in range(phases):
        wait = period * phase / phases
        speed, force = _from(law, sampling, r, ratio, wait, 1.0, 0.0, samples)
        restitution, force_per_speed = max(restitution, speed), max(force_per_speed, force)
        if pressing > 0.0:
            speed, force = _from(law, sampling, r, ratio, wait, 0.0, pressing, samples)
            added_speed, static_force = max(added_speed, speed), max(static_force, force)
    return _MARGIN * restitution, _MARGIN * added_speed, _MARGIN * force_per_speed, _MARGIN * static_force


@njit()
def late_blow(law: Law, sampling: Sampling, r: float, ratio: float) -> tuple[float, float, float, float]:
    """Upper bounds of one contact with damping r (N s/m) and a spring `ratio` times as stiff while the stick rises.

    Returns: factor of the entry speed; speed added by a pressing hand (m/s); head force per m/s of entry speed (N s/m);
    force added by pressing (N). inf: there is no bound.
    """
    period = sampling.period
    hand = -law.k_hand * law.z_ss / law.m
    half_turn = math.pi * math.sqrt(law.m / (law.k_coll * ratio + law.k_hand))
    lag = period * (1 + sampling.delay_ticks)
    if 2.0 * lag > half_turn or 2.0 * r * lag > law.m:
        return math.inf, math.inf, math.inf, math.inf  # a blow would be half over before its force comes
    stiffest = law.k_coll * ratio
    # A hand that lifts shortens the contact, the more the slower it is; what comes after it only throws.
    thrown = 1.0 + lag * (r + 0.5 * stiffest * lag) / law.m if hand < 0.0 else 1.0
    if half_turn > max(_FINE_SAMPLES * period, _SHORT_LAGS * lag):
        restitution, added_speed, force_per_speed, static_force = _by_lag(
            law, sampling, r, ratio, max(hand, 0.0)
        )
    else:
        restitution, added_speed, force_per_speed, static_force = _by_phase(
            law, sampling, r, ratio, half_turn, max(hand, 0.0)
        )
    if hand < 0.0:
        restitution = max(restitution, 1.0)
    return restitution * thrown, added_speed, force_per_speed * thrown, static_force
