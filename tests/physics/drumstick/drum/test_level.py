"""A drum is as loud on every mesh and at every rate of the device, and leaves the limiter alone."""

import dataclasses

import numpy as np
import pytest

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.output.limiter import KNEE
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick.perception.jnd import LEVEL_dB
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text

# Neither the place nor the force of the trial run by which a drum gets its level.
PLAYED = OfflineStrike(0.0, 0.3, 0.25, 5.0, 0.005)
MESHES = (("draft", 48000), ("standard", 48000), ("fine", 48000), ("standard", 44100), ("standard", 96000))


def shipped(name: str) -> Scene:
    return parse(shipped_text(name), name)


def level_dB(scene: Scene, rate_Hz: int) -> float:  # noqa: N802
    """Power of a blow's first second below 4 kHz."""
    sound = render(scene, [PLAYED], 1.0, rate_Hz).mean(axis=1, dtype=np.float64)
    spectrum = np.fft.rfft(sound)[: round(4000.0 * len(sound) / rate_Hz)]
    return float(20.0 * np.log10(np.linalg.norm(spectrum) / len(sound)))


@pytest.mark.parametrize("name", ["accents", "bare-drum", "double-stroke", "phantom"])
def test_a_drum_is_as_loud_on_every_mesh(name: str) -> None:
    scene = shipped(name)
    levels = [
        level_dB(dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, accuracy=accuracy)), rate_Hz)
        for accuracy, rate_Hz in MESHES
    ]
    assert np.ptp(levels) < LEVEL_dB, dict(zip(MESHES, levels, strict=True))


@pytest.mark.parametrize("name", shipped_names())
def test_a_full_scale_strike_leaves_the_limiter_alone(name: str) -> None:
    """Struck where the scene plays."""
    scene = shipped(name)
    blow = strike_for_speed(scene, scene.strike.full_scale_m_per_s, scene.hand.orbit_radius, 0.0)
    assert 0.2 < np.abs(render(scene, [blow], 0.1, 48000)).max() < KNEE
