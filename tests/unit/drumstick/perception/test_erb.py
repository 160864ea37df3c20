"""Bands of an ear: where they lie, and how far two sounds are apart in them."""

import numpy as np
import pytest

from drumstick.perception.erb import erb_number, spectral_distance

RATE_HZ = 48_000


def noise(level: float = 1.0) -> np.ndarray:
    return level * np.random.default_rng(3).standard_normal(RATE_HZ)


@pytest.mark.parametrize(("f_Hz", "number"), [(100.0, 3.4), (1000.0, 15.6), (8000.0, 33.2)])
def test_bands_lie_where_glasberg_and_moore_put_them(f_Hz: float, number: float) -> None:
    assert float(erb_number(f_Hz)) == pytest.approx(number, abs=0.1)


@pytest.mark.parametrize("off_dB", [-3.0, 0.5, 6.0])
def test_a_sound_that_much_louder_is_so_far_away(off_dB: float) -> None:
    assert spectral_distance(noise(10.0 ** (off_dB / 20.0)), noise(), RATE_HZ) == pytest.approx(abs(off_dB))
    assert spectral_distance(noise(), noise(), RATE_HZ) == 0.0


def test_what_lies_above_is_left_out_when_asked() -> None:
    spectrum = np.fft.rfft(noise())
    spectrum[np.fft.rfftfreq(RATE_HZ, 1.0 / RATE_HZ) > 6000.0] = 0.0
    dull = np.fft.irfft(spectrum)
    assert spectral_distance(dull, noise(), RATE_HZ) > 20.0
    assert spectral_distance(dull, noise(), RATE_HZ, below_Hz=4000.0) < 0.1
