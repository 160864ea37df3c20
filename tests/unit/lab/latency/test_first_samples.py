"""First samples in made recordings, JACK's frames on the monotonic clock, and which strike a sound belongs to."""

import numpy as np
import pytest

from drumstick_lab.benchmarks.latency.first_samples import cycles_of, delays_ns, first_samples, times_ns
from drumstick_lab.benchmarks.latency.jack_listener import Integers, Recorded

RATE_HZ, BLOCK = 48_000, 64
PERIOD_NS = BLOCK * 1e9 / RATE_HZ
BEGUN_NS = 5_000_000_000
_CHANCE = np.random.default_rng(1)


def _beats(at: list[int], frames: int, rest: float = 0.0) -> np.ndarray:
    # Strikes that rise within 2 ms and are 60 dB down after 20 ms.
    t_s = np.arange(round(0.03 * RATE_HZ)) / RATE_HZ
    beat = np.minimum(t_s / 0.002, 1.0) * 10.0 ** (-3.0 * t_s / 0.02) * np.sin(2.0 * np.pi * 300.0 * t_s)
    samples = rest * _CHANCE.standard_normal(frames)
    for first in at:
        samples[first : first + len(beat)] += beat
    return samples.astype(np.float32)


def _recorded(frames: Integers, callback_ns: Integers, samples: np.ndarray | None = None) -> Recorded:
    firsts = BLOCK * np.arange(len(frames))
    heard = np.zeros(BLOCK * len(frames), np.float32) if samples is None else samples
    return Recorded(heard, np.stack((firsts, frames, callback_ns), axis=1).astype(np.int64), RATE_HZ)


def _late_ns(cycles: int) -> Integers:
    # Of a callback on a busy machine: mostly 50 us, now and then far more, never less.
    late = 50_000 + _CHANCE.exponential(20_000, cycles)
    late[_CHANCE.random(cycles) < 0.1] += 900_000
    late[::16] = 50_000
    return np.round(late).astype(np.int64)


def test_each_strike_has_one_first_sample_soon_after_it_began() -> None:
    struck = [3000, 5087, 7200, 9333]
    found = first_samples(_beats(struck, 12_000, rest=1e-5), RATE_HZ)
    assert len(found.at) == len(struck)
    assert np.all((found.at - struck >= 0) & (found.at - struck < 0.001 * RATE_HZ))
    assert found.rest < 0.1


def test_one_loud_sample_does_not_hide_the_strikes() -> None:
    samples = _beats([3000, 5087, 7200, 9333], 12_000)
    samples[11_500] = 40.0
    assert len(first_samples(samples, RATE_HZ).at) == 5


def test_what_rings_on_is_no_strike_and_is_told() -> None:
    samples = _beats([3000, 5087], 7000)
    samples[1500:2990] += np.float32(0.002)
    found = first_samples(samples, RATE_HZ)
    assert len(found.at) == 2
    assert 0.1 < found.rest < 1.0


def test_silence_has_none() -> None:
    assert len(first_samples(np.zeros(12_000, np.float32), RATE_HZ).at) == 0


def test_late_callbacks_do_not_move_the_cycles() -> None:
    due_ns = BEGUN_NS + np.round(PERIOD_NS * np.arange(2000)).astype(np.int64)
    found = cycles_of(_recorded(BLOCK * np.arange(2000), due_ns + _late_ns(2000)))
    assert np.all(np.abs(found.begun_ns - due_ns - 50_000) < 1000)
    assert np.percentile(found.held_up_ns, 99) > 800_000


@pytest.mark.parametrize("skipped", [0, 4])
def test_a_device_that_stood_still_goes_on_where_it_does(skipped: int) -> None:
    """With its frames counted on meanwhile, or not; and then for less time than it stood still."""
    numbers = np.arange(2000)
    due_ns = (
        BEGUN_NS + np.round(PERIOD_NS * numbers).astype(np.int64) + np.where(numbers < 1000, 0, 4_700_000)
    )
    frames = BLOCK * (numbers + np.where(numbers < 1000, 0, skipped))
    found = cycles_of(_recorded(frames, due_ns + _late_ns(2000)))
    apart = np.abs(found.begun_ns - due_ns - 50_000)
    near = (numbers > 1000 - 16) & (numbers < 1000 + 16)  # there a callback may be the promptest around
    assert np.all(apart[~near] < 1000)
    assert np.all(found.begun_ns >= due_ns)


def test_frames_go_on_where_their_32_bits_begin_anew() -> None:
    due_ns = BEGUN_NS + np.round(PERIOD_NS * np.arange(500)).astype(np.int64)
    frames = (2**32 - 200 * BLOCK + BLOCK * np.arange(500)) % 2**32
    found = cycles_of(_recorded(frames, due_ns))
    assert np.all(np.abs(found.begun_ns - due_ns) < 1000)


def test_a_sample_has_its_place_in_its_cycle() -> None:
    due_ns = BEGUN_NS + np.round(PERIOD_NS * np.arange(500)).astype(np.int64)
    at = np.array([0, 63, 64, 64 * 300 + 17])
    times = times_ns(_recorded(BLOCK * np.arange(500), due_ns), at)
    assert np.all(np.abs(times - BEGUN_NS - at * 1e9 / RATE_HZ) < 1000)


def test_a_sound_belongs_to_the_newest_strike_that_can_have_made_it() -> None:
    struck = np.array([100, 200, 300, 400])
    heard = np.array([50, 103, 305, 310, 404])
    delays, unheard = delays_ns(struck, heard)
    assert delays.tolist() == [3, 5, 4]
    assert unheard == 1
    assert delays_ns(struck, struck + 150, 140)[0].tolist() == [150, 150, 150, 150]
