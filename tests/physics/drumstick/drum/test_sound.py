"""Sound of one blow: pitch, decay, and how the place changes the colour."""

import dataclasses

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.calibrate import full_scale
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene

RATE = 48000
Sound = npt.NDArray[np.float32]


def drum(**changes: float) -> Scene:
    scene = Scene("drum")
    return dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, **changes))


def spectrum(sound: Sound) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    mono = sound.mean(axis=1)
    return (
        np.fft.rfftfreq(4 * len(mono), 1.0 / RATE),
        np.abs(np.fft.rfft(mono * np.hanning(len(mono)), 4 * len(mono))),
    )


def level_at(sound: Sound, f_Hz: float) -> float:
    f, level = spectrum(sound)
    return float(level[np.abs(f - f_Hz) < 3.0].max())


@pytest.mark.parametrize("accuracy", ["draft", "standard", "fine"])
def test_pitch_is_the_scenes(accuracy: str) -> None:
    scene = dataclasses.replace(
        drum(f01_Hz=150.0), mesh=dataclasses.replace(Scene("x").mesh, accuracy=accuracy)
    )
    sound = render(scene, [OfflineStrike(0.0, 0.0, 0.0, 5.0, 0.005)], 1.5, RATE)[RATE // 10 :]
    f, level = spectrum(sound)
    near = (f > 100.0) & (f < 200.0)
    found = f[near][np.argmax(level[near])]
    assert 1200.0 * abs(np.log2(found / 150.0)) < 3.0


@pytest.mark.parametrize("t60_s", [0.4, 1.2, 5.0])
def test_decay_of_the_lowest_mode_is_the_scenes(t60_s: float) -> None:
    scene = drum(f01_Hz=150.0, t60_s=t60_s)
    sound = (
        render(scene, [OfflineStrike(0.0, 0.0, 0.0, 5.0, 0.005)], 0.8 * t60_s, RATE)
        .mean(axis=1)
        .astype(np.float64)
    )
    # Down to 0 Hz and through a window of 80 ms: only the lowest mode is left.
    turning = sound * np.exp(-2j * np.pi * 150.0 / RATE * np.arange(len(sound)))
    window = np.hanning(RATE * 80 // 1000)
    places = np.arange(RATE // 50, len(sound) - len(window), RATE // 100)
    level_dB = [20.0 * np.log10(abs(np.vdot(window, turning[i : i + len(window)]))) for i in places]
    slope_dB_per_s = np.polyfit(places / RATE, level_dB, 1)[0]
    assert -60.0 / slope_dB_per_s == pytest.approx(t60_s, rel=0.01)


def bessel(n: int, x: float) -> float:
    """J_n(x) by Bessel's own integral."""
    angle = (np.arange(2000) + 0.5) * np.pi / 2000
    return float(np.mean(np.cos(n * angle - x * np.sin(angle))))


@pytest.mark.parametrize(("n", "zero"), [(1, 3.831706), (2, 5.135622)])
def test_the_place_changes_the_modes(n: int, zero: float) -> None:
    """Mode (n, 1) takes up J_n(zero r) cos(n angle) of a blow at radius r: nothing at the centre, much near the rim."""
    scene = drum(f01_Hz=150.0, t60_s=2.0)
    heard: dict[float, float] = {}
    for r in (0.0, 0.5, 0.9):
        sound = render(scene, [OfflineStrike(0.0, r, 0.0, 0.5, 0.001)], 1.0, RATE)
        heard[r] = level_at(sound, 150.0 * zero / 2.404826) / level_at(sound, 150.0)
    share = {r: bessel(n, zero * r) / bessel(0, 2.404826 * r) for r in (0.5, 0.9)}
    assert heard[0.0] < 0.02 * heard[0.5]
    assert heard[0.9] / heard[0.5] == pytest.approx(share[0.9] / share[0.5], rel=0.05)


def test_a_struck_membrane_is_reciprocal_and_pans() -> None:
    """Pickups left and right of the centre: the louder channel is that of the pickup next to the blow."""
    scene = dataclasses.replace(
        drum(), listen=dataclasses.replace(Scene("x").listen, pickups=((-0.6, 0.0, -1.0), (0.6, 0.0, 1.0)))
    )
    left = render(scene, [OfflineStrike(0.0, -0.6, 0.0, 0.5, 0.0005)], 0.2, RATE)
    right = render(scene, [OfflineStrike(0.0, 0.6, 0.0, 0.5, 0.0005)], 0.2, RATE)
    assert np.abs(left[:, 0]).max() > 1.5 * np.abs(left[:, 1]).max()
    assert np.allclose(left, right[:, ::-1], atol=0.02 * np.abs(left).max())


def test_a_roll_is_heard_as_its_strikes() -> None:
    scene = drum(t60_s=0.3)
    blow = full_scale(scene)
    strikes = [OfflineStrike(i / 23.0, 0.4, 0.1, 0.3 * blow.peak_N, 0.001) for i in range(46)]
    mono = render(scene, strikes, 2.0, RATE).mean(axis=1).astype(np.float64)
    edge = np.abs(np.diff(mono))  # the attack is brighter than the ring
    envelope = edge[: len(edge) // 48 * 48].reshape(-1, 48).mean(axis=1)
    level = np.abs(np.fft.rfft((envelope - envelope.mean()) * np.hanning(len(envelope)), 16384))
    f = np.fft.rfftfreq(16384, 1e-3)
    audible = (f > 8.0) & (f < 40.0)
    assert f[audible][np.argmax(level[audible])] == pytest.approx(23.0, abs=0.3)
