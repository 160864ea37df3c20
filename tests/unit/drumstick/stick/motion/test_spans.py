"""Nothing falls between two nodes: spans against the motion sampled densely, in any regime of damping."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drumstick.stick.motion.crossing import point_after, start_of, weighted
from drumstick.stick.motion.spans import cut, first_nodes, first_zero, head_force_rate, later, nearest
from drumstick.stick.segment import Pulses, Segment, free_response
from realtime.kernels.jit import njit

Numbers = npt.NDArray[np.float64]

SAMPLES = 300
MAX_SPANS = 30
SURE = 1e-10  # share of the largest terms from which on a sign is not rounding
REST = 1e-3  # m/s; at rest under +-100 m/s^2 everything is rounding
M_KG = 0.015


@njit()
def _spans(seg: Any, horizon: float, ends: Numbers) -> int:
    # The loop of events.first_event, without its events.
    here = start_of(seg)
    nodes = first_nodes(seg, here, True)
    count = 0
    while here.t < horizon and count < ends.shape[0] - 3:
        for end in cut(seg, here, point_after(seg, min(horizon, nearest(nodes)))):
            ends[count] = end.t
            count += 1
            here = end
        nodes = later(nodes, here.t)
    return count


@njit()
def _sample(seg: Any, times: Numbers, speed: Numbers, rate: Numbers, terms: Numbers) -> None:
    for i in range(times.shape[0]):
        point = point_after(seg, times[i])
        speed[i] = point.v
        rate[i] = weighted(head_force_rate(seg), point)[0]
        terms[i] = abs(seg.k * point.v) + abs(seg.r * point.z2)


@njit()
def _free(a: float, w2: float, y: float, rate: float, t: float) -> float:
    c, s, _ = free_response(a, w2, t)
    return y * c + rate * s


def _segment(regime: tuple[float, float], start: tuple[float, float, float], pulses: Pulses) -> Segment:
    a, w2 = regime
    z, v, g = start
    return Segment(a, w2, g, z, v, pulses, w2 * M_KG, a * M_KG, 0.0, 0, None)


def _sign_changes(values: Numbers, unsure: float) -> int:
    signs = np.sign(values[np.abs(values) > unsure])
    return int(np.count_nonzero(signs[1:] != signs[:-1]))


def _changes_in_spans(seg: Segment, horizon: float) -> list[tuple[int, int]]:
    """For each span, how often z' and the push's rate change their sign among densely spaced samples."""
    ends = np.zeros(MAX_SPANS)
    ends = ends[: _spans(seg, horizon, ends)]
    begins = np.concatenate([[0.0], ends[:-1]])
    share = np.sort(np.concatenate([np.linspace(0.0, 1.0, SAMPLES), np.geomspace(1e-9, 1.0, SAMPLES)]))
    times = begins[:, None] + share * (ends - begins)[:, None]
    speed, rate, terms = np.zeros((3, times.size))
    _sample(seg, times.ravel(), speed, rate, terms)
    unsure = SURE * max(np.abs(speed).max(), REST), SURE * max(terms.max(), REST * (seg.k + 1e2 * seg.r))
    rows = zip(speed.reshape(times.shape), rate.reshape(times.shape), strict=True)
    return [(_sign_changes(v, unsure[0]), _sign_changes(q, unsure[1])) for v, q in rows]


def _decades(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


REGIMES = st.tuples(st.just(0.0) | _decades(1.0, 1e6), st.just(0.0) | _decades(1.0, 1e10))
STARTS = st.tuples(st.floats(-1e-2, 0.0), st.floats(-2.0, 2.0), st.floats(-100.0, 100.0))
SIGNED = st.sampled_from([-1.0, 0.0, 1.0]).flatmap(lambda sign: _decades(1e-6, 1e6).map(lambda x: sign * x))
PULSES = st.lists(st.tuples(st.floats(-1e4, 1e4), _decades(1.0, 1e6)), max_size=2).map(tuple)


@pytest.mark.long
@settings(max_examples=500)
@given(REGIMES, STARTS, PULSES, st.floats(0.5, 20.0))
@example((43.3, 3.3e5), (0.0, -0.5, -27.0), ((500.0, 500.0),), 5.0)
@example((43.3, 3.3e5), (0.0, -0.5, -27.0), ((1e4, 3e3), (-9e3, 900.0)), 5.0)
@example((3.0, 1333.0), (0.0, 0.01, -27.0), ((-4e3, 3e3), (1.4e3, 700.0)), 2.0)
@example((3e3, 3.3e5), (0.0, -0.01, -27.0), ((1e4, 5e3), (-9e3, 800.0)), 8.0)
def test_speed_and_push_rate_vanish_at_most_once_in_a_span(
    regime: tuple[float, float], start: tuple[float, float, float], pulses: Pulses, radians: float
) -> None:
    seg = _segment(regime, start, pulses)
    for rate in (math.sqrt(regime[1]), regime[0], *(lam for _, lam in pulses)):
        changes = _changes_in_spans(seg, radians / max(rate, 1.0))
        assert all(v <= 1 and q <= 1 for v, q in changes), changes


@given(REGIMES, SIGNED, SIGNED)
def test_the_first_zero_of_a_free_motion(regime: tuple[float, float], y: float, rate: float) -> None:
    """Zero there, and the sign of the start everywhere before; without one, the sign of the start for ever."""
    a, w2 = regime
    zero = first_zero(a, w2, y, rate)
    assert zero > 0.0 or y == 0.0 or abs(y) < 1e-12 * abs(rate)
    last = zero if math.isfinite(zero) else 30.0 / max(a, math.sqrt(w2), 1.0)
    times = last * np.linspace(1e-6, 1.0 - 1e-6, SAMPLES)
    values = np.array([_free(a, w2, y, rate, t) for t in times])
    sure = values[np.abs(values) > 1e-9 * np.abs(values).max()]
    assert len(set(np.sign(sure))) <= 1
    if math.isfinite(zero) and values.any():
        assert abs(_free(a, w2, y, rate, zero)) <= 1e-9 * np.abs(values).max()
