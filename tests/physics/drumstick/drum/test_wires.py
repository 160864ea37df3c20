"""A snare drum's wires as they are heard: what they add, and that it is not the mesh's rate that makes their sound."""

import dataclasses
import itertools

import numpy as np
import pytest

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from stability.catalogue import shows

RATE = 48_000
DYNAMICS = (0.1, 0.3, 1.0)  # of full scale
EDGES_HZ = (500.0, 1000.0, 2500.0, 5000.0, 10_000.0)


def snare(strainer: float = 1.0, rate_Hz: float = 24_000.0) -> Scene:
    scene = parse(shipped_text("snare"), "snare.toml")
    effects = dict(scene.drum.effects)
    effects["snare"] = dataclasses.replace(effects["snare"], strainer=strainer)
    drum = dataclasses.replace(scene.drum, effects=effects)
    return dataclasses.replace(scene, drum=drum, mesh=dataclasses.replace(scene.mesh, rate_Hz=rate_Hz))


def spectrum(scene: Scene, share: float, x: float) -> tuple[np.ndarray, np.ndarray]:
    """Power of a stroke of this share of full scale, over frequency in Hz, above 30 Hz; of 1 in all."""
    blow = strike_for_speed(scene, share * scene.strike.full_scale_m_per_s, x, 0.1)
    sound = render(scene, [blow], 1.0, RATE).astype(float).mean(axis=1)
    power = np.abs(np.fft.rfft(sound)) ** 2
    f_Hz = np.fft.rfftfreq(len(sound), 1.0 / RATE)
    power[f_Hz < 30.0] = 0.0
    return power / power.sum(), f_Hz


def level_of(power: np.ndarray, f_Hz: np.ndarray, low_Hz: float, high_Hz: float) -> float:
    """Share of a band, dB."""
    return 10.0 * float(np.log10(power[(f_Hz >= low_Hz) & (f_Hz < high_Hz)].sum()))


def flatness(power: np.ndarray, f_Hz: np.ndarray) -> float:
    middle = power[(f_Hz > 500.0) & (f_Hz < 8000.0)]
    return float(np.exp(np.log(middle).mean()) / middle.mean())


def test_wires_on_the_head_make_the_upper_octaves() -> None:
    """From 2 to 8 kHz 10 dB more of the whole sound, mean over the dynamics (a recorded snare: 6 to 13). Noise, not
    tones: a flatness over 0.12 in the middle, where the drum without them has less than half of that."""
    more: list[float] = []
    flat: list[tuple[float, float]] = []
    for share in DYNAMICS:
        on, f_Hz = spectrum(snare(), share, 0.3)
        off, _ = spectrum(snare(0.0), share, 0.3)
        more.append(level_of(on, f_Hz, 2000.0, 8000.0) - level_of(off, f_Hz, 2000.0, 8000.0))
        flat.append((flatness(on, f_Hz), flatness(off, f_Hz)))
    assert np.mean(more) >= 10.0, more
    assert np.median(flat, axis=0)[0] > 0.12
    assert np.median(flat, axis=0)[1] < 0.06


@shows("wires on a finer mesh", "naive")
def test_a_stroke_on_wires_is_another_one_on_a_finer_mesh() -> None:
    """Sample by sample no mesh confirms the one before, and with wires not even the same blow a trifle harder does."""

    def sound(rate_Hz: float, share: float = 0.3, strainer: float = 1.0) -> np.ndarray:
        scene = snare(strainer, rate_Hz)
        blow = strike_for_speed(scene, share * scene.strike.full_scale_m_per_s, 0.3, 0.1)
        heard = np.fft.rfft(render(scene, [blow], 0.3, RATE).astype(float).mean(axis=1))
        heard[: round(1000.0 * 0.3)] = 0.0  # above 1 kHz, where the wires are heard
        return np.fft.irfft(heard)

    def apart(one: np.ndarray, other: np.ndarray) -> float:
        return float(np.sqrt(np.mean((other - one) ** 2) / np.mean(one**2)))

    assert apart(sound(48_000.0), sound(24_000.0)) > 1.0
    assert apart(sound(48_000.0), sound(48_000.0, 0.3001)) > 0.1
    assert apart(sound(48_000.0, strainer=0.0), sound(48_000.0, 0.3001, strainer=0.0)) < 0.002


@shows("wires on a finer mesh", "ours")
@pytest.mark.long
def test_a_finer_mesh_has_wires_of_the_same_sound() -> None:
    """Bands of meshes at 24 and 48 kHz, means over dynamics and places: each stroke alone is chaotic."""

    def levels(rate_Hz: float) -> np.ndarray:
        heard: list[list[float]] = []
        for share in (0.1, 0.18, 0.32, 0.56, 1.0):
            for x in (0.15, 0.3, 0.5):
                power, f_Hz = spectrum(snare(rate_Hz=rate_Hz), share, x)
                heard.append([level_of(power, f_Hz, *edges) for edges in itertools.pairwise(EDGES_HZ)])
        return np.mean(heard, axis=0)

    apart = levels(48_000.0) - levels(24_000.0)
    assert abs(apart[3]) < 1.0, "5 to 10 kHz"
    assert np.abs(apart).max() < 2.0
