"""The force loop and an equal loop in C are due on one grid, in the same window: drumstick lab lateness in small."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.benchmarks.force_loop.lateness_pair import (
    WARM_TICKS,
    CLoop,
    Kept,
    ServoLoop,
    Window,
    built,
    compared,
    window,
)
from haptic_server import block, files
from haptic_server.records import NO_FAULT

pytestmark = [pytest.mark.long, pytest.mark.real_clock]
PERIOD_NS = 1_000_000
TICKS = 1000


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("lateness")
    (made / files.SCENE).write_text(shipped_text("roll"), encoding="utf-8")
    return made


@pytest.fixture(scope="module")
def servo(folder: Path) -> Iterator[ServoLoop]:
    with closing(ServoLoop(folder)) as started:
        yield started


@pytest.mark.needs("cc")
@pytest.mark.timeout(180)
def test_ours_is_due_as_the_loop_in_c_beside_it_is(servo: ServoLoop, folder: Path) -> None:
    """The delay that each of them then has is the machine's: `drumstick lab lateness`."""
    other = CLoop(built(folder), parse(shipped_text("roll"), "roll"))
    seen = window(servo, other, 1000, TICKS, swapped=False)
    for kept in (seen.ours, seen.other):
        assert len(kept.due_ns) == TICKS
        assert np.all(kept.late_ns >= 0)
        assert np.all(np.diff(kept.due_ns) % PERIOD_NS == 0)  # an overrun skips whole periods
        assert np.all(np.diff(kept.due_ns) > 0)
    assert (seen.other.due_ns[0] - seen.ours.due_ns[0]) % PERIOD_NS == PERIOD_NS // 2
    assert servo.ended[-1]["fault"] == NO_FAULT
    assert servo.ended[-1]["seq"] >= 15, "it rolls at 23 Hz meanwhile"
    assert servo.granted["scheduler"].startswith("SCHED_FIFO") == (other.granted["scheduler"] == "granted")


def test_what_a_window_keeps_is_what_the_servo_counts(servo: ServoLoop, folder: Path) -> None:
    """The ticks of a window are the servo's own: its block holds them in its histogram, in bins of 10 us."""
    law = block.attach(folder, _law()).lateness.copy()
    servo.start(
        0, TICKS
    )  # long past: the first tick is late by all that time, and all the missed ones are skipped
    kept = servo.kept()
    counted = block.attach(folder, _law()).lateness - law
    assert TICKS <= counted.sum() <= TICKS + WARM_TICKS
    bins = np.minimum(kept.late_ns // block.LATENESS_BIN_NS, block.LATENESS_BINS - 1)
    assert np.all(np.bincount(bins, minlength=block.LATENESS_BINS) <= counted)


def _law() -> np.dtype[np.void]:
    from drumstick.stick.law import law_of

    return law_of(parse(shipped_text("roll"), "roll")).dtype


def test_a_slower_loop_would_be_seen_and_a_stall_is_nobodys_fault() -> None:
    due = np.delete(np.arange(2000) * PERIOD_NS, slice(501, 508))  # what a stall of 7 ms makes a loop skip
    rng = np.random.default_rng(5)
    quick = rng.integers(20_000, 40_000, len(due))
    stalled = quick.copy()
    stalled[500] += 7_000_000
    stalls = np.array([[due[500] + 30_000, due[500] + 7_020_000]])
    found = compared([Window(Kept(due, 2 * quick), Kept(due, stalled), stalls, [])])
    assert found["ratio"]["p50"] == pytest.approx(2.0, rel=0.01)
    assert found["c"]["lateness"]["max_us"] > 7000.0
    assert found["c"]["discounted"]["max_us"] < 100.0
    assert found["c"]["ticks_discounted"] == 1
