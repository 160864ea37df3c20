"""Between two events the stick obeys one linear equation, so its motion is known in closed form.

    z'' + 2 a z' + w2 z = g + sum of p exp(-lam t)

with a = R/(2m), w2 = K/m, g = (K_hand z_ss + f)/m and p each pulse's acceleration at t = 0. Then

    z = z0 C + v0 S + g G(0) + sum of p G(lam),   G(lam; t) = integral of S(t - s) exp(-lam s) ds

where C and S are the solutions that start with (1, 0) and (0, 1). Every damping regime and a vanishing
stiffness go through the same code. Where the closed form of G would cancel (small times, 1/tau near an
eigenvalue) it is summed as a power series and doubled up to t. Relative error about 1e-13. Kernels: any
thread; no allocation.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from realtime.kernels.jit import njit, overload

# For each pulse of the scene, running or not: its acceleration p (m/s^2) at the start and its rate lam (1/s).
Pulses = tuple[tuple[float, float], ...]
# A quantity and its first four derivatives.
Derivatives = tuple[float, float, float, float, float]


class Segment(NamedTuple):
    """The constants of one stretch of motion: the equation's, its start, and the head that events ask about.

    The head pushes with -k z - r z' + f (N/m, N s/m, N); a, w2 and g contain it only while the stick is in contact.
    `method`: None is the closed form, a number one of drumstick.stick.methods.
    """

    a: float
    w2: float
    g: float
    z: float
    v: float
    pulses: Pulses
    k: float
    r: float
    f: float
    release: int
    method: int | None


_CANCELLED = 1e-4  # below this share of its terms a difference has lost too many digits
_SERIES_TERMS = 24  # enough for 1e-17 at rho t <= 1


@njit()
def free_response(a: float, w2: float, t: float) -> tuple[float, float, float]:
    """C(t), S(t), S'(t) of z'' + 2 a z' + w2 z = 0; w2 >= 0, and a >= 0 or a^2 < w2."""
    discriminant = w2 - a * a
    if discriminant > 0.0:
        wd = math.sqrt(discriminant)
        decay = math.exp(-a * t)
        sine = decay * math.sin(wd * t) * (1.0 / wd)
        cosine = decay * math.cos(wd * t)
        return cosine + a * sine, sine, cosine - a * sine
    split = math.sqrt(-discriminant)
    slow = -w2 / (a + split) if a > 0.0 else 0.0  # -(a - split) without the cancellation
    slow_decay = math.exp(slow * t)
    fast_decay = math.exp(-(a + split) * t)
    sine = (
        slow_decay * t if split * t < 1e-300 else slow_decay * -math.expm1(-2.0 * split * t) / (2.0 * split)
    )
    return slow_decay - slow * sine, sine, fast_decay + slow * sine


@njit()
def fastest_rate(a: float, w2: float, lam: float) -> float:
    """The largest modulus of the eigenvalues, 1/s."""
    discriminant = a * a - w2
    own = a + math.sqrt(discriminant) if discriminant > 0.0 else math.sqrt(w2)
    return max(own, lam)


@njit()
def _forced_by_series(a: float, w2: float, lam: float, t: float) -> tuple[float, float]:
    # G = sum of t^(k+2)/(k+2)! h_k, with h_k the complete homogeneous symmetric polynomials of the three
    # eigenvalues
    e1 = -2.0 * a - lam
    e2 = w2 + 2.0 * a * lam
    e3 = -w2 * lam
    h1, h2, h3 = 1.0, 0.0, 0.0
    weight = t
    forced, forced_rate = 0.5 * t * t, t
    for k in range(1, _SERIES_TERMS):
        h1, h2, h3 = e1 * h1 - e2 * h2 + e3 * h3, h1, h2
        weight *= t / (k + 1)
        forced_rate += weight * h1
        forced += weight * t / (k + 2) * h1
    return forced, forced_rate


@njit()
def _forced_by_doubling(a: float, w2: float, lam: float, t: float) -> tuple[float, float]:
    doublings = 0
    start = t
    while fastest_rate(a, w2, lam) * start > 1.0:
        start *= 0.5
        doublings += 1
    forced, forced_rate = _forced_by_series(a, w2, lam, start)
    for _ in range(doublings):
        c, s, s_rate = free_response(a, w2, start)
        fade = math.exp(-lam * start)
        forced, forced_rate = (
            c * forced + s * forced_rate + fade * forced,
            -w2 * s * forced + s_rate * forced_rate + fade * forced_rate,
        )
        start *= 2.0
    return forced, forced_rate


@njit()
def forced_response(
    a: float, w2: float, lam: float, t: float, c: float, s: float, s_rate: float
) -> tuple[float, float]:
    """G(lam; t) and its rate; c, s, s_rate as `free_response` gives them for the same a, w2, t."""
    determinant = lam * lam - 2.0 * a * lam + w2
    fade = math.exp(-lam * t)
    numerator = fade - c + lam * s
    numerator_rate = -lam * fade + w2 * s + lam * s_rate
    size = fade + abs(c) + lam * abs(s)
    size_rate = lam * fade + w2 * abs(s) + lam * abs(s_rate)
    # <= and not <: when everything has died away, an eigenvalue equal to lam would leave 0/0.
    if abs(numerator) <= _CANCELLED * size or abs(numerator_rate) <= _CANCELLED * size_rate:
        return _forced_by_doubling(a, w2, lam, t)
    share = 1.0 / determinant
    return numerator * share, numerator_rate * share


@njit()
def constant_response(a: float, w2: float, t: float, c: float) -> float:
    """G(0; t), whose rate is S(t); c as `free_response` gives it for the same a, w2, t."""
    if 1.0 - c <= _CANCELLED:
        return _forced_by_doubling(a, w2, 0.0, t)[0]
    return (1.0 - c) * (1.0 / w2)


def _forced_by_pulses(
    pulses: Pulses, a: float, w2: float, t: float, c: float, s: float, s_rate: float
) -> tuple[float, float, float]:
    raise TypeError("compiled code only")


@overload(_forced_by_pulses)
def _forced_by_each_pulse(
    pulses: Any, a: Any, w2: Any, t: Any, c: Any, s: Any, s_rate: Any
) -> Callable[..., tuple[float, float, float]]:
    def none(
        pulses: Any, a: float, w2: float, t: float, c: float, s: float, s_rate: float
    ) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.0

    def summed(
        pulses: Any, a: float, w2: float, t: float, c: float, s: float, s_rate: float
    ) -> tuple[float, float, float]:
        z, v, z2 = 0.0, 0.0, 0.0
        for p, lam in pulses:
            if p != 0.0:
                forced, forced_rate = forced_response(a, w2, lam, t, c, s, s_rate)
                z += p * forced
                v += p * forced_rate
                z2 += p * (math.exp(-lam * t) - 2.0 * a * forced_rate - w2 * forced)
        return z, v, z2

    return summed if len(pulses) > 0 else none


def pulse_acceleration_now(pulses: Pulses, t: float) -> Derivatives:
    """Acceleration (m/s^2) of all pulses t seconds into the segment, and its first four derivatives."""
    raise TypeError("compiled code only")


@overload(pulse_acceleration_now)
def _acceleration_of_each(pulses: Any, t: Any) -> Callable[..., Derivatives]:
    def none(pulses: Any, t: float) -> Derivatives:
        return 0.0, 0.0, 0.0, 0.0, 0.0

    def summed(pulses: Any, t: float) -> Derivatives:
        p0, p1, p2, p3, p4 = 0.0, 0.0, 0.0, 0.0, 0.0
        for p, lam in pulses:
            if p != 0.0:
                now = p * math.exp(-lam * t)
                p0 += now
                p1 -= lam * now
                p2 += lam**2 * now
                p3 -= lam**3 * now
                p4 += lam**4 * now
        return p0, p1, p2, p3, p4

    return summed if len(pulses) > 0 else none


def _fastest_pulse(pulses: Pulses) -> float:
    raise TypeError("compiled code only")


@overload(_fastest_pulse)
def _fastest_of_each(pulses: Any) -> Callable[..., float]:
    def none(pulses: Any) -> float:
        return 0.0

    def largest(pulses: Any) -> float:
        fastest = 0.0
        for p, lam in pulses:
            if p != 0.0:
                fastest = max(fastest, lam)
        return fastest

    return largest if len(pulses) > 0 else none


@njit()
def fastest_pulse_rate(seg: Segment) -> float:
    """The rate at which the quickest of the running pulses fades, 1/s; 0 when none runs."""
    return _fastest_pulse(seg.pulses)


@njit()
def fastest_rate_in(seg: Segment) -> float:
    """The rate of the quickest change in the segment, 1/s: each derivative is at most so many times the one before."""
    return fastest_rate(seg.a, seg.w2, fastest_pulse_rate(seg))


@njit()
def propagate(seg: Segment, t: float) -> tuple[float, float, float]:
    """Position, speed and acceleration t seconds into the segment; all three die away when the motion does."""
    c, s, s_rate = free_response(seg.a, seg.w2, t)
    pull = seg.g - seg.w2 * seg.z
    z = seg.z * c + seg.v * s
    v = seg.v * s_rate + pull * s
    z2 = pull * s_rate - seg.v * (2.0 * seg.a * s_rate + seg.w2 * s)
    if seg.g != 0.0:
        z += seg.g * constant_response(seg.a, seg.w2, t, c)
    forced, forced_rate, forced_rate2 = _forced_by_pulses(seg.pulses, seg.a, seg.w2, t, c, s, s_rate)
    return z + forced, v + forced_rate, z2 + forced_rate2


def pulses_at_start(pulses: Pulses) -> float:
    """Acceleration of all pulses now, m/s^2."""
    raise TypeError("compiled code only")


@overload(pulses_at_start)
def _sum_at_start(pulses: Any) -> Callable[..., float]:
    def none(pulses: Any) -> float:
        return 0.0

    def summed(pulses: Any) -> float:
        acceleration = 0.0
        for p, _ in pulses:
            acceleration += p
        return acceleration

    return summed if len(pulses) > 0 else none


@njit()
def acceleration_at_start(seg: Segment) -> float:
    """Like `acceleration` at the segment's start, to the last bit, without a look at how pulses fade."""
    return seg.g - 2.0 * seg.a * seg.v - seg.w2 * seg.z + pulses_at_start(seg.pulses)


@njit()
def onward(seg: Segment, z: float, v: float, pulses: Pulses) -> Segment:
    """Same equation, from another start."""
    return Segment(seg.a, seg.w2, seg.g, z, v, pulses, seg.k, seg.r, seg.f, seg.release, seg.method)


@njit()
def acceleration(seg: Segment, t: float, z: float, v: float) -> float:
    """The right-hand side: z'' at (z, v), t seconds into the segment."""
    return seg.g - 2.0 * seg.a * v - seg.w2 * z + pulse_acceleration_now(seg.pulses, t)[0]
