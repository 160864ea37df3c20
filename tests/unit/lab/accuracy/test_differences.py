"""Levels by octave have their sign, and are of the spectrum's shape alone."""

import math

import numpy as np
import pytest

from drumstick_lab.accuracy.exact.differences import (
    OCTAVES_Hz,
    brighter_dB,
    levelled,
    louder_dB,
    mode_by_mode,
)

RATE_Hz = 48_000
T_S = np.arange(RATE_Hz) / RATE_Hz


def tones(*levels_dB: float) -> np.ndarray:
    waves = [
        10.0 ** (level / 20.0) * np.sin(2.0 * math.pi * f_Hz * T_S)
        for f_Hz, level in zip(OCTAVES_Hz, levels_dB, strict=True)
    ]
    return np.sum(waves, axis=0)


def test_a_dull_sound_has_less_above_and_a_loud_one_is_no_brighter() -> None:
    wanted, dull = tones(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -80.0), tones(0.0, 0.0, 0.0, 0.0, 0.0, -6.0, 0.0)
    dull = dull - tones(*[-300.0] * 6, 0.0)
    louder = louder_dB(dull, wanted)
    assert louder == pytest.approx(10.0 * math.log10((5.0 + 10.0**-0.6) / 6.0), abs=1e-3)
    found = brighter_dB(dull, wanted, RATE_Hz)
    assert found[:5] == pytest.approx([-louder] * 5, abs=1e-3)
    assert found[5] == pytest.approx(-6.0 - louder, abs=0.01)
    assert found[6] is None  # the wanted sound has nothing there
    assert brighter_dB(3.0 * wanted, wanted, RATE_Hz)[:6] == pytest.approx([0.0] * 6, abs=1e-9)
    assert levelled(3.0 * wanted, wanted) == pytest.approx(wanted)


def test_a_mode_that_is_sharp_and_fades_sooner_is_told_so() -> None:
    t_s = np.arange(1.2 * RATE_Hz) / RATE_Hz

    def partials(cents: float, t60_s: float) -> np.ndarray:
        turn = 2.0 * math.pi * 2.0 ** (cents / 1200.0)
        fade = np.exp(-math.log(1000.0) / t60_s * t_s)
        return fade * (np.sin(turn * 150.0 * t_s) + 0.3 * np.sin(turn * 239.0 * t_s))

    cents, decays = mode_by_mode(partials(2.0, 1.08), partials(0.0, 1.2), (150.0, 239.0), (1.2, 1.2), RATE_Hz)
    assert cents == pytest.approx([2.0, 2.0], abs=0.01)
    assert decays == pytest.approx([-0.1, -0.1], abs=1e-3)
