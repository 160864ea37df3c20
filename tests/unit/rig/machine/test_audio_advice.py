"""Block and priority that `drumstick audio-test` recommends of rows that are made up, and its words on delays."""

from dataclasses import replace

import pytest

from haptic_server.servo.priority import FIFO_PRIORITY
from rig.machine.audio_advice import Delay, Row, advise, perceived
from rig.machine.real_time import LIMITS

BLOCKS = (32, 64, 128, 256, 512, 1024)
BAD = {
    "a late block": {"late": 1, "late_ours": 1},
    "an xrun": {"xruns": 1, "xruns_ours": 1},
    "too long": {"share_ours_p99": 0.71},
    "not a number": {"share_ours_p99": float("nan")},
    "lost": {"lost": "the device stopped"},
}


def row(block: int, real_time: bool, granted: bool) -> Row:
    """One that fits, with the delay of a device of two blocks."""
    ms = block / 48.0
    return Row(
        block=block, block_ms=ms, priority="SCHED_FIFO 5" if real_time else "ordinary", real_time=real_time,
        granted=granted, blocks=1000, share_p50=0.1, share_p99=0.2, share_worst=0.4, share_ours_p99=0.2, late=0,
        late_ours=0, xruns=0, xruns_ours=0, waited_ms=ms + 1.0, device_ms=ms + 0.75,
        delay_ms=Delay(ms + 0.75, 1.5 * ms + 1.25, 2.0 * ms + 1.75),
    )  # fmt: skip


def rows(granted_real_time: bool, fits_from: int, other_from: int) -> list[Row]:
    """Both priorities, each of which fits from this block on."""
    found: list[Row] = []
    for block in BLOCKS:
        for granted, least in ((True, fits_from), (False, other_from)):
            made = row(block, granted_real_time == granted, granted)
            found.append(made if block >= least else replace(made, late=3, late_ours=3))
    return found


def advised(rows: list[Row], granted: int) -> tuple[tuple[int, bool] | None, list[str]]:
    """Block and priority that are recommended, and the words."""
    row, words = advise(rows, granted)
    return (None if row is None else (row.block, row.real_time)), words


def test_the_smallest_block_that_fits_as_the_server_plays() -> None:
    chosen, words = advised(rows(True, 64, 128), 5)
    assert chosen == (64, True)
    assert words == ["play with --audio-block 64 (1.3 ms)", "priority: real time (5), as it should be"]


@pytest.mark.parametrize("what", BAD)
def test_a_block_with_this_is_not_recommended(what: str) -> None:
    tried = [row(block, True, True) for block in BLOCKS]
    tried[1] = replace(tried[1], **BAD[what])
    assert advised(tried[1:], 5)[0] == (128, True)


def test_what_the_machine_was_to_blame_for_does_not_count() -> None:
    excused = replace(row(64, True, True), late=2, xruns=1, share_worst=9.0)
    assert advised([excused], 5)[0] == (64, True)


def test_a_larger_block_that_does_not_fit_is_told() -> None:
    tried = [row(block, True, True) for block in BLOCKS]
    tried[4] = replace(tried[4], xruns=1, xruns_ours=1)
    chosen, words = advised(tried, 5)
    assert chosen == (32, True)
    assert "(512)" in words[-1]
    assert "longer" in words[-1]


def test_nothing_fits() -> None:
    chosen, words = advised(rows(True, 9999, 9999), 5)
    assert chosen is None
    assert words[0].startswith("no block fits")


def test_a_device_that_was_lost_is_not_a_drum_that_takes_too_long() -> None:
    lost = replace(row(128, True, True), lost="the device stopped")
    chosen, words = advised([lost], 5)
    assert chosen is None
    said = "the device was lost at block 128 (the device stopped): see to it, and test again"
    assert words[0] == said
    assert not any("too long" in each for each in words)
    chosen, words = advised([row(64, True, True), lost], 5)
    assert (chosen, words[-1]) == ((64, True), said)


def test_only_with_a_priority_that_the_server_has_not() -> None:
    chosen, words = advised(rows(False, 9999, 64), 0)
    assert chosen == (64, True)
    assert words[0].endswith("with real-time priority")
    assert "block 64 fits with it" in words[1]


def test_only_without_priority() -> None:
    chosen, words = advised(rows(True, 9999, 128), 5)
    assert chosen == (128, False)
    assert words[0].endswith("without real-time priority")
    assert "real-time throttling" in words[1]


def test_what_priority_would_gain_is_told() -> None:
    chosen, words = advised(rows(False, 256, 64), 0)
    assert chosen == (256, False)
    assert "block 64 fits with it" in words[1]
    _, words = advised(rows(False, 256, 9999), 0)
    assert "no block fits with it" in words[1]


def test_priority_that_cannot_be_had_is_told_as_doctor_does() -> None:
    chosen, words = advised([row(block, False, True) for block in BLOCKS], 0)
    assert chosen == (32, False)
    assert LIMITS in words[1]


@pytest.mark.parametrize("granted", [FIFO_PRIORITY, 95])
def test_the_sound_must_not_come_before_the_force_loop(granted: int) -> None:
    _, words = advised(rows(True, 64, 64), granted)
    assert f"not below the force loop's {FIFO_PRIORITY}" in words[1]


def delayed(least: float, typical: float, most: float) -> Row:
    return replace(row(64, True, True), delay_ms=Delay(least, typical, most))


@pytest.mark.parametrize(
    ("typical", "said"),
    [
        (4.0, "rated 10 ms like none (Jack, 2018)"),
        (10.0, "rated 10 ms like none (Jack, 2018)"),
        (10.1, "this is between"),
        (20.0, "rated 20 ms worse than none (Jack, 2018)"),
        (24.0, "from 24 ms tap and sound are told apart (Adelstein, 2003)"),
    ],
)
def test_what_a_delay_means(typical: float, said: str) -> None:
    words = perceived(delayed(typical, typical, typical))[0]
    assert words.startswith(f"{typical:.1f} ms")
    assert words.endswith(said)


@pytest.mark.parametrize(
    ("spread", "said"),
    [
        (1.0, "within the goal of 1 ms (Wessel and Wright, 2002)"),
        (1.1, "less than the +- 3 ms that were rated worse (Jack, 2018)"),
        (5.9, "less than the +- 3 ms that were rated worse (Jack, 2018)"),
        (6.1, "as much as the +- 3 ms that were rated worse (Jack, 2018)"),
    ],
)
def test_what_its_spread_means(spread: float, said: str) -> None:
    assert said in perceived(delayed(4.0, 6.0, 4.0 + spread))[1]


def test_what_makes_it_even_covers_waiting_and_message() -> None:
    # 64 frames: waits of 2.33 ms, and the message; then the device's 2.08 ms.
    assert perceived(row(64, True, True))[1].endswith("[drum] latency_s = 0.004 makes it even, at 6.1 ms")
    assert "latency_s = 0.001 is too short" in perceived(row(64, True, True), 0.001)[1]
