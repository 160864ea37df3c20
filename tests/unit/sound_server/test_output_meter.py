"""Meter of the sum as it leaves: level, peak, and frames that the limiter bent."""

import math

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.limiter import KNEE, limited
from drumstick.drum.output.output_meter import OUTPUT_METER, limit_and_measure
from drumstick.parameters.drum import Drum
from drumstick.parameters.scene import Scene
from sound_server.mixer import Mixer, mix

RATE = 48_000
BLOCK = 128
Sound = npt.NDArray[np.float32]


class Metered:
    """Kernel with its own memory; numbers as the meter shows them."""

    def __init__(self, channels: int = 2) -> None:
        self.rows = np.zeros(1, OUTPUT_METER)
        self.mean_squares = np.zeros(channels)

    def play(self, sound: Sound, block: int = BLOCK) -> None:
        for first in range(0, len(sound), block):
            limit_and_measure(sound[first : first + block], self.rows, self.mean_squares, RATE)

    def __getitem__(self, name: str) -> float:
        return float(self.rows[name][0])


def sine(amplitude: float, seconds: float) -> Sound:
    tone = amplitude * np.sin(2.0 * np.pi * 1000.0 / RATE * np.arange(round(seconds * RATE)))
    return np.column_stack([np.zeros_like(tone), tone]).astype(np.float32)


def test_a_sines_level_and_peak_are_known_and_are_the_loudest_channels() -> None:
    meter = Metered()
    meter.play(sine(0.5, 2.0))
    assert meter["rms"] == pytest.approx(0.5 / math.sqrt(2.0), rel=1e-3)
    assert meter["peak"] == pytest.approx(0.5, rel=1e-6)
    assert meter["limited_frames"] == meter["clipped_frames"] == 0


def test_it_shows_99_percent_of_a_steady_tone_after_300_ms_whatever_the_block() -> None:
    """As a VU meter does: IEC 60268-17."""
    found: list[float] = []
    for block in (32, 128, 1000):
        meter = Metered()
        meter.play(sine(0.5, 0.3), block)
        found.append(meter["rms"])
    assert found[0] == pytest.approx(0.99 * 0.5 / math.sqrt(2.0), rel=2e-3)
    assert found == pytest.approx([found[0]] * 3, rel=1e-12)


def test_peak_and_level_fall_back() -> None:
    meter = Metered()
    meter.play(sine(0.5, 1.0))
    meter.play(np.zeros((round(0.3 * RATE), 2), np.float32), block=96)
    assert meter["peak"] == pytest.approx(0.5 / math.e, rel=1e-3)
    assert meter["rms"] == pytest.approx(0.5 / math.sqrt(2.0) * math.sqrt(1.0 - 0.99**2), rel=1e-2)


def test_frames_are_counted_that_are_bent_and_that_are_at_full_scale() -> None:
    """One that two channels bend counts once; what is as loud as the threshold is not bent."""
    sound = np.zeros((2 * BLOCK, 2), np.float32)
    sound[3] = KNEE, -KNEE
    sound[5] = 0.8, 0.0
    sound[7] = 0.8, -0.9
    sound[BLOCK + 1] = 0.0, -5.0
    bent = np.vectorize(limited)(sound.astype(float))
    meter = Metered()
    meter.play(sound)
    assert (meter["limited_frames"], meter["clipped_frames"]) == (3, 1)
    assert sound == pytest.approx(bent, abs=1e-7)
    meter.play(np.full((BLOCK, 2), 5.0, np.float32))
    assert (meter["limited_frames"], meter["clipped_frames"]) == (3 + BLOCK, 1 + BLOCK)
    assert meter["peak"] == 1.0


def struck(speed_m_per_s: float = 2.0) -> Engine:
    ring = StrikeRing()
    engine = build(Scene("drum", drum=Drum()), RATE, ring)
    ring.push(0, 0.3, 0.1, speed_m_per_s, 0.004)
    return engine


def played(mixer: Mixer, frames: int, channels: int = 2) -> Sound:
    out = np.zeros((frames, channels), np.float32)
    for first in range(0, frames, BLOCK):
        mix(mixer.buffers, out[first : first + BLOCK], RATE, round(first * 1e9 / RATE))
    return out


def test_several_drums_are_limited_together_though_none_is_alone() -> None:
    sound = np.zeros((4096, 2), np.float32)
    render_all(struck(), sound, BLOCK, 0)
    engines = [struck() for _ in range(14)]
    together = np.zeros_like(sound)
    for _ in engines:
        together += sound
    summed = np.abs(together).max(axis=1)
    assert np.abs(sound).max() < KNEE < summed.max()
    mixer = Mixer(RATE)
    for engine in engines:
        mixer.enter(engine)
    played(mixer, len(sound))
    meter = mixer.buffers.meter[0]
    assert meter["limited_frames"] == np.count_nonzero(summed > KNEE)
    assert all(engine.meters[0]["peak_left"] < KNEE < meter["peak"] for engine in engines)


@pytest.mark.parametrize("channels", [2, 4])
def test_one_drum_alone_shows_the_peak_that_the_output_shows(channels: int) -> None:
    mixer = Mixer(RATE, channels)
    engine = struck()
    mixer.enter(engine)
    for _ in range(3):
        played(mixer, 2048, channels)
        own = engine.meters[0]
        assert mixer.buffers.meter[0]["peak"] == pytest.approx(
            max(own["peak_left"], own["peak_right"]), rel=1e-6
        )


def test_a_device_of_one_channel_is_metered_as_it_sounds() -> None:
    mixer = Mixer(RATE, 1)
    mixer.enter(struck())
    sound = played(mixer, BLOCK * 8, channels=1)
    assert mixer.buffers.meter[0]["peak"] >= np.abs(sound[-BLOCK:]).max() > 0.0
    assert mixer.buffers.mean_squares[1] == 0.0


def test_a_sample_that_is_no_number_is_forgotten_in_the_next_block() -> None:
    meter, broken = Metered(), sine(0.5, 0.1)
    broken[100] = np.nan
    meter.play(broken)
    meter.play(sine(0.5, 2.0))
    assert meter["rms"] == pytest.approx(0.5 / math.sqrt(2.0), rel=1e-3)
    assert meter["peak"] == pytest.approx(0.5, rel=1e-6)
