"""Motions that gateway-share plays, delays that it reads, and its stored result."""

from itertools import islice, pairwise

import numpy as np

from drumstick_lab.benchmarks.gateway.gateway_share import Phase, delays
from drumstick_lab.benchmarks.gateway.moving_servo import (
    RATE_HZ,
    SPEED_M_PER_S,
    lying,
    rolling,
    swung,
    unforeseen,
)
from haptic_server.gateway.event_wait import MAX_SLEEP_NS, flight_ns, is_still
from haptic_server.records import RELEASE, STRIKE


def test_the_roll_strikes_at_its_rate_from_flights_that_foresee_it() -> None:
    moments = list(islice(rolling(), 10_000))
    kinds = [what for _, _, what in moments if what in (STRIKE, RELEASE)]
    assert abs(kinds.count(STRIKE) - 10.0 * RATE_HZ) <= 1.0
    assert all(one != two for one, two in pairwise(kinds))
    for (z, v, _), (_, _, what) in pairwise(moments):
        assert abs(v) <= SPEED_M_PER_S
        assert what != STRIKE or flight_ns(z, v) <= 1e6


def test_the_others_are_what_they_are_called() -> None:
    assert all(is_still(z, v) for z, v, _ in islice(lying(), 100))
    assert all(z >= 0.02 - 1e-9 and what != STRIKE for z, _, what in islice(swung(), 1000))
    moments = list(islice(unforeseen(), 2000))
    assert all(flight_ns(z, v) > MAX_SLEEP_NS for z, v, _ in moments)
    assert sum(what == STRIKE for _, _, what in moments) > 10


def test_delays_are_told_strike_by_strike() -> None:
    ticks = np.arange(1, 41) * 1_000_000
    numbers = np.arange(1, 41)
    heard = {
        "bare": np.stack([numbers, ticks + 100_000 * numbers], 1),
        "osc": np.stack([numbers, ticks + 100_000 * numbers + 70_000], 1)[::-1],
        "zenoh": np.stack([numbers, ticks + 100_000 * numbers + 90_000], 1)[:-3],
    }
    found = delays(
        [Phase(0.0, 0.0, 1, 20), Phase(0.0, 0.0, 21, 40)], ticks, heard, np.zeros((0, 2), np.int64)
    )
    assert found["strikes"] == 20
    assert found["osc_above_bare_p50_us"] == found["osc_above_bare_p99_us"] == 70.0
    assert (found["zenoh_above_bare_p50_us"], found["zenoh_lost"], found["osc_lost"]) == (90.0, 3, 0)
