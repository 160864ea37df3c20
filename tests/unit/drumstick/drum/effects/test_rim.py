"""The hoop: heard when the rim is struck, tuned, and silent for a stroke in the middle."""

import dataclasses

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.calibrate import PEAK_OF_FULL_SCALE, full_scale
from drumstick.drum.effects.rim import RATIOS
from drumstick.drum.render import render
from drumstick.parameters.drum_effects import Rim
from drumstick.parameters.scene import Scene

RATE = 48000


def sound(table: Rim | None, x: float) -> npt.NDArray[np.float64]:
    scene = Scene("drum")
    effects = {} if table is None else {"rim": table}
    drum = dataclasses.replace(scene.drum, f01_Hz=300.0, t60_s=0.05, effects=effects)
    scene = dataclasses.replace(scene, drum=drum)
    blow = dataclasses.replace(full_scale(scene), x=x)
    return render(scene, [blow], 0.5, RATE)[:, 0].astype(float)


def test_the_middle_does_not_ring_the_hoop() -> None:
    assert np.array_equal(sound(Rim(), 0.0), sound(None, 0.0))


def test_the_hoop_rings_at_its_modes() -> None:
    """After the head has died away, the lowest ones are left, at a ring's ratios."""
    rung = (sound(Rim(f_Hz=600.0, t60_s=1.0), 1.0) - sound(None, 1.0))[2400:]
    spectrum = np.abs(np.fft.rfft(rung * np.hanning(len(rung))))
    step_Hz = RATE / len(rung)
    for ratio in RATIOS[:2]:
        at = round(600.0 * ratio / step_Hz)
        near = spectrum[at - 3 : at + 4]
        assert near.max() > 20.0 * np.median(spectrum[at - 60 : at + 60])
        assert abs(int(np.argmax(near)) - 3) <= 1


def test_its_level_is_what_the_scene_says() -> None:
    """Of a whole stroke on the rim, whose contact with the head is far longer than the hoop's."""
    one, half = (sound(Rim(level=level), 1.0) - sound(None, 1.0) for level in (0.8, 0.4))
    assert np.abs(one).max() == pytest.approx(2.0 * np.abs(half).max(), rel=1e-3)
    assert 0.4 * 0.8 * PEAK_OF_FULL_SCALE < np.abs(one).max() < 1.1 * 0.8 * PEAK_OF_FULL_SCALE
