import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import firwin

from drumstick.drum.output.upsample import TAPS, interpolated, interpolator, remember


def upsampled(signal: npt.NDArray[np.float64], factor: int) -> npt.NDArray[np.float64]:
    phases, history, head = interpolator(factor), np.zeros((2, 2 * TAPS), np.float32), 0
    out: list[float] = []
    for sample in signal:
        head = remember(history, head, sample, -sample)
        for p in range(factor):
            out.append(interpolated(history, head, 0, phases[p]))
            assert interpolated(history, head, 1, phases[p]) == pytest.approx(-out[-1], abs=1e-6)
    return np.array(out)


@pytest.mark.parametrize("factor", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("cycles_per_step", [0.01, 0.1, 0.3])
def test_a_sine_stays_a_sine_delayed_by_half_the_filter(factor: int, cycles_per_step: float) -> None:
    steps = np.arange(200)
    out = upsampled(np.sin(2 * np.pi * cycles_per_step * steps), factor)
    t = np.arange(len(out)) / factor - TAPS / 2
    settled = t > TAPS / 2
    assert np.allclose(out[settled], np.sin(2 * np.pi * cycles_per_step * t[settled]), atol=2e-3)


def test_a_constant_does_not_sound() -> None:
    out = upsampled(np.ones(100), 3)[3 * TAPS :]
    assert np.ptp(out) < 1e-6
    assert out[0] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("factor", [1, 2, 3, 4, 7])
def test_the_design_is_a_well_known_one(factor: int) -> None:
    """scipy's windowed design of the same length and window, each phase scaled to pass a constant as it is."""
    whole = np.asarray(firwin(factor * TAPS + 1, 2.0 * 0.45 / factor, window=("kaiser", 8.0), scale=False))
    phases = whole[:-1].reshape(TAPS, factor).T
    assert interpolator(factor) == pytest.approx(phases / phases.sum(axis=1, keepdims=True), abs=1e-6)
