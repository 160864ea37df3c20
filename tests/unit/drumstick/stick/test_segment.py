"""The closed form of a segment against a matrix exponential in 60 digits: another method, another arithmetic."""

import math
from typing import Any

import mpmath
import pytest

from drumstick.stick.segment import Segment, pulse_acceleration_now
from drumstick.stick.segment import propagate as along
from realtime.kernels.jit import njit

# a, w2, lam: what a name promises holds for the numbers behind it.
REGIMES = {
    "set A in contact": (43.3, 334666.7, 500.0),
    "set A above": (3.33, 1333.3, 500.0),
    "undamped": (0.0, 1333.3, 500.0),
    "free flight": (0.0, 0.0, 500.0),
    "only drag": (50.0, 0.0, 500.0),
    "critical": (577.0, 577.0**2, 500.0),
    "just below critical": (577.0, 577.0**2 * (1.0 + 1e-13), 500.0),
    "just above critical": (577.0, 577.0**2 * (1.0 - 1e-13), 500.0),
    "overdamped": (3e4, 334666.7, 500.0),
    "1/tau is the critical eigenvalue": (500.0, 500.0**2, 500.0),
    "1/tau is the slow eigenvalue": (600.0, 500.0 * 700.0, 500.0),
    "1/tau is the fast eigenvalue": (600.0, 500.0 * 700.0, 700.0),
    "1/tau is the drag": (250.0, 0.0, 500.0),
    "1/tau nearly the slow eigenvalue": (600.0, 500.0 * 700.0, 500.0 * (1.0 + 1e-9)),
    "quick pulse": (3.33, 1333.3, 1e6),
    "slow pulse": (43.3, 334666.7, 1.0),
    "stiff and light": (5.0, 1e10, 500.0),
    "heavily damped and light": (5e6, 1e10, 1e6),
}
TIMES = [1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 0.01, 0.1, 3.0]
# z, v, g, p: each part of the solution by itself.
STARTS = {"position": (1.0, 0.0, 0.0, 0.0), "speed": (0.0, 1.0, 0.0, 0.0), "constant": (0.0, 0.0, 1.0, 0.0)}
STARTS["pulse"] = (0.0, 0.0, 0.0, 1.0)
DIGITS = 60


@njit()
def _after(seg: Any, t: float) -> tuple[float, float, float]:
    z, v, _ = along(seg, t)
    return z, v, pulse_acceleration_now(seg.pulses, t)[0]


def propagate(
    a: float, w2: float, g: float, lam: float, z: float, v: float, p: float, t: float
) -> tuple[float, float, float]:
    """Position, speed and push after t seconds, with one pulse."""
    seg = Segment(a, w2, g, z, v, ((p, lam),), 0.0, 0.0, 0.0, 0, None)
    return _after(seg, t)


def _by_matrix(
    a: float, w2: float, lam: float, start: tuple[float, float, float, float], t: float
) -> tuple[float, float]:
    z, v, g, p = start
    rate = max(2.0 * a, math.sqrt(w2), lam) * t
    with mpmath.workdps(
        DIGITS + int(rate.bit_length() if isinstance(rate, int) else math.log10(1.0 + rate)) * 4
    ):
        motion = mpmath.matrix(
            [
                [0, 1, 0, 0],
                [-mpmath.mpf(w2), -2 * mpmath.mpf(a), 1, 1],
                [0, 0, -mpmath.mpf(lam), 0],
                [0, 0, 0, 0],
            ]
        )
        end = mpmath.expm(motion * mpmath.mpf(t)) * mpmath.matrix([z, v, p, g])
        return float(end[0]), float(end[1])


@pytest.mark.parametrize("part", STARTS)
@pytest.mark.parametrize("regime", REGIMES)
def test_against_the_matrix_exponential(regime: str, part: str) -> None:
    """Position and speed to 1e-12 of the motion's size, at every time up to a thousand time constants."""
    a, w2, lam = REGIMES[regime]
    z, v, g, p = STARTS[part]
    fastest = max(a + math.sqrt(max(a * a - w2, 0.0)), math.sqrt(w2), lam if p else 0.0, 1e-9)
    compared = 0
    for t in TIMES:
        if fastest * t > 1000.0:
            continue
        z_exact, v_exact = _by_matrix(a, w2, lam, STARTS[part], t)
        z_ours, v_ours, _ = propagate(a, w2, g, lam, z, v, p, t)
        size = math.hypot(z_exact, v_exact / fastest)
        # Rounding of w t alone turns the phase of an oscillation by 1e-16 w t.
        tolerance = size * (1e-12 + 4e-16 * fastest * t)
        assert abs(z_ours - z_exact) <= tolerance
        assert abs(v_ours - v_exact) <= tolerance * fastest
        compared += 1
    assert compared >= 3


@pytest.mark.parametrize("regime", REGIMES)
def test_after_a_very_long_time_all_is_at_rest(regime: str) -> None:
    a, w2, lam = REGIMES[regime]
    z, v, p = propagate(a, w2, 3.0, lam, 0.1, -1.0, 1000.0, 1e7)
    assert p == 0.0
    assert math.isfinite(z)
    assert math.isfinite(v)
    if a > 0.0 and w2 > 0.0:
        assert z == pytest.approx(3.0 / w2, rel=1e-9)
        assert v == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("regime", REGIMES)
def test_no_time_is_no_motion(regime: str) -> None:
    a, w2, lam = REGIMES[regime]
    assert propagate(a, w2, 3.0, lam, 0.1, -1.0, 7.0, 0.0) == (0.1, -1.0, 7.0)
