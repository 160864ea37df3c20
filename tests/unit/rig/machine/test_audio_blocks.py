"""Late blocks, waits and delays of blocks and strikes that are made up."""

import numpy as np
import pytest

from rig.machine.audio_blocks import (
    Numbers,
    Played,
    StrikePath,
    is_enough,
    late_blocks,
    newer,
    row_of,
    waits_ms,
)

PERIOD_NS = 1_000_000
NO_STALL = np.zeros((0, 2), np.int64)


def played(begun_us: list[int], spent_us: int = 100) -> Numbers:
    """Blocks that begin then, and take so long."""
    return np.array([(1000 * at, 1000 * spent_us, 0) for at in begun_us], np.int64)


@pytest.mark.parametrize(
    ("begun_us", "spent_us", "late"),
    [
        ([0, 1000, 2000, 3000], 100, 0),
        ([0, 1000, 2890, 3000], 100, 0),  # late, and done in time
        ([0, 1000, 2910, 3000], 100, 1),  # and not the one after it
        ([0, 1000, 2000, 3000], 1100, 3),
        ([0, 0, 0, 3000, 3000, 3000, 6000], 100, 2),  # a device that takes three at a time
    ],
)
def test_late_is_what_is_not_done_when_the_next_is_due(begun_us: list[int], spent_us: int, late: int) -> None:
    assert late_blocks(played(begun_us, spent_us), PERIOD_NS, NO_STALL) == (late, late)


@pytest.mark.parametrize(("stall_us", "ours"), [((2000, 2900), 0), ((2000, 2005), 1), ((3010, 4000), 1)])
def test_a_stall_of_the_machine_excuses_only_what_it_covers(stall_us: tuple[int, int], ours: int) -> None:
    stalls = 1000 * np.array([stall_us], np.int64)
    assert late_blocks(played([0, 1000, 2910, 3000]), PERIOD_NS, stalls) == (1, ours)


def test_a_block_that_ends_while_they_are_copied_is_left_for_the_next_look() -> None:
    told = played([9000, 5000, 6000, 7000, 8000])
    assert newer(told, 5_000_000)[:, 0].tolist() == [6_000_000, 7_000_000, 8_000_000]
    assert newer(played([7000, 8000, 9000]), 8_000_000)[:, 0].tolist() == [9_000_000]
    assert newer(told[:0], 0).shape == (0, 3)


def test_a_strike_waits_for_the_next_block() -> None:
    waits = waits_ms(played([0, 1000, 2000]), 1000 * np.array([1, 1000, 1250, 2500], np.int64))
    assert waits == pytest.approx([0.999, 0.0, 0.75])  # and the last is not played any more


def test_the_delay_is_tick_wait_and_device() -> None:
    waits = np.linspace(0.0, 2.0, 101)
    delay = StrikePath(tick_ms=1.0, latency_ms=0.0, device_ms=4.75).delay(waits)
    assert (delay.least, delay.typical, delay.most) == pytest.approx((4.77, 6.25, 7.73))


def test_the_scenes_latency_takes_the_place_of_tick_and_wait() -> None:
    waits = np.linspace(0.0, 2.0, 101)
    delay = StrikePath(tick_ms=1.0, latency_ms=5.0, device_ms=4.75).delay(waits)
    assert (delay.least, delay.typical, delay.most) == pytest.approx((9.75, 9.75, 9.75))


def test_a_row_has_shares_of_the_block_and_what_the_machine_explains() -> None:
    blocks = played([0, 1000, 2000, 3000, 4910, 5000, 6000])
    struck = 1000 * np.array([500, 1500, 2500], np.int64)
    stalls = 1000 * np.array([(4000, 4900)], np.int64)
    path = StrikePath(1.0, 0.0, 2.0)
    row = row_of(Played(blocks, struck, stalls, 1, ""), 48, 48_000, path, "SCHED_FIFO 5", True)
    assert (row.block_ms, row.share_p50, row.real_time) == (pytest.approx(1.0), pytest.approx(0.1), True)
    assert (row.late, row.late_ours, row.xruns, row.xruns_ours) == (1, 0, 1, 0)
    assert (row.waited_ms, row.device_ms, row.fits) == (pytest.approx(1.5), 2.0, True)
    unexplained = row_of(Played(blocks, struck, NO_STALL, 1, ""), 48, 48_000, path, "ordinary", True)
    assert (unexplained.xruns_ours, unexplained.real_time, unexplained.fits) == (1, False, False)


def test_a_device_that_is_lost_before_a_strike_was_played_is_not_judged() -> None:
    blocks = np.array([[0, 100, 0], [1_000_000, 100, 0]], np.int64)
    assert is_enough(Played(blocks, np.array([500_000]), NO_STALL, 0, ""))
    assert not is_enough(Played(blocks, np.array([1_500_000]), NO_STALL, 0, ""))
    assert not is_enough(Played(blocks[:1], np.array([0]), NO_STALL, 0, ""))
