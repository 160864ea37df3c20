"""Microphones above a bank of modes: Rayleigh's integral of each mode by a plain sum, and what a mesh's are told."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import special

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.air import AirTable
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.modal.air_load import in_air
from drumstick.drum.modal.radiation import heard_by, on_place_and_movement
from drumstick.drum.render import render
from drumstick.parameters.drum import Drum, Listen, Mesh, Modal
from drumstick.parameters.scene import Scene

RATE, SOUND_M_PER_S = 48_000, 343.2
ABOVE, BESIDE = (0.7, 0.0, 0.3, -1.0), (-0.6, 1.4, 2.0, 1.0)


def _scene(*microphones: tuple[float, ...], air: bool = False) -> Scene:
    effects = {"air": AirTable(1.2, 0.26)} if air else {}
    drum = Drum(f01_Hz=200.0, radius_m=0.16, t60_s=1.0, effects=effects)
    return Scene("drum", drum=drum, modal=Modal(5000.0), listen=Listen(microphones=microphones))


def _plain_sum(scene: Scene, where: tuple[float, ...], order: int, zero: float, f_Hz: float) -> complex:
    # -k^2 int shape exp(-i k r)/r dA, over 400 x 720 places.
    k = 2.0 * math.pi * f_Hz * scene.drum.radius_m / SOUND_M_PER_S
    r = (np.arange(400) + 0.5) / 400.0
    phi = np.arange(720) * (2.0 * math.pi / 720.0)
    way = np.sqrt(
        (r[:, None] * np.cos(phi) - where[0]) ** 2
        + (r[:, None] * np.sin(phi) - where[1]) ** 2
        + where[2] ** 2
    )
    shape = special.jv(order, zero * r)[:, None] * np.cos(order * phi)
    area = r[:, None] / 400.0 * (2.0 * math.pi / 720.0)
    return complex(-(k**2) * np.sum(shape * np.exp(-1j * k * way) / way * area))


def test_each_mode_is_heard_as_the_sum_over_the_head() -> None:
    scene = _scene(ABOVE, BESIDE)
    head = in_air(60.0, scene.drum)
    shortest_m = scene.drum.radius_m * 0.3
    for (even, _), where in zip(heard_by(scene, 60.0), (ABOVE, BESIDE), strict=True):
        most = float(np.abs(even).max())
        for at in (0, 1, 3, 7, 20, 60, len(even) - 1):
            f_Hz = float(head.f_Hz[at])
            plain = _plain_sum(scene, where, int(head.modes.orders[at]), float(head.modes.zeros[at]), f_Hz)
            late = np.exp(2j * math.pi * f_Hz * shortest_m / SOUND_M_PER_S)
            assert abs(even[at] - plain * late) < 1e-3 * most, (at, where)


def test_of_two_that_differ_by_their_azimuth_alone_each_has_its_own() -> None:
    """A pair on both sides of the drum: modes of cos(m phi) alike, of sin(m phi) the other way round."""
    (even, odd), (other_even, other_odd) = heard_by(
        _scene((0.5, 0.4, 0.3, -1.0), (0.5, -0.4, 0.3, 1.0)), 20.0
    )
    assert np.abs(odd).max() > 0.1 * np.abs(even).max()
    assert other_even == pytest.approx(even, rel=1e-12)
    assert other_odd == pytest.approx(-odd, rel=1e-12)
    aside, _ = heard_by(_scene((0.5, 0.4, 0.3, -1.0), (0.5, -0.4, 0.8, 1.0)), 20.0)[1]
    assert np.abs(aside - other_even).max() > 0.1 * np.abs(even).max()  # nor is the height left out


def test_in_air_a_mode_is_heard_by_the_shape_that_it_has_there() -> None:
    scene = _scene(BESIDE, air=True)
    head = in_air(60.0, scene.drum)
    even, _ = heard_by(scene, 60.0)[0]
    # The lowest mode, as the sum of the vacuum's that it is.
    own = np.flatnonzero(head.basis.orders == 0)
    parts = np.zeros(len(head.basis.zeros))
    parts[own] = head.mixed(np.eye(len(parts)))[own, 0]
    sums = [_plain_sum(scene, BESIDE, 0, float(head.basis.zeros[at]), float(head.f_Hz[0])) for at in own[:8]]
    plain = complex(np.dot(parts[own[:8]], sums))
    assert abs(parts[own[1]]) > 0.01
    assert abs(even[0]) == pytest.approx(abs(plain), rel=5e-3)


def test_place_and_movement_make_a_wave_of_any_phase() -> None:
    theta, heard = np.array([0.05, 0.9, 2.5]), np.array([1.0 + 2.0j, -0.3j, -1.5 + 0.2j])
    place, movement = on_place_and_movement(heard, theta)
    for n in range(7):
        now, before = np.exp(1j * theta * n), np.exp(1j * theta * (n - 1))
        by_gains = place * now.real + movement * (now.real - before.real)
        assert by_gains == pytest.approx((heard * now).real, abs=1e-12)


def _levels_of_partials(scene: Scene, f_Hz: list[float]) -> np.ndarray:
    sound = render(scene, [OfflineStrike(0.0, 0.35, 0.1, 5.0, 0.0008)], 0.6, RATE)[2400:, 0].astype(float)
    window = np.hanning(len(sound))
    spectrum = np.abs(np.fft.rfft(sound * window, 1 << 18))
    f = np.fft.rfftfreq(1 << 18, 1.0 / RATE)
    return np.array([20.0 * math.log10(spectrum[(f > 0.985 * at) & (f < 1.015 * at)].max()) for at in f_Hz])


def test_a_bank_is_heard_as_a_mesh_is() -> None:
    """Levels of the first partials under the same microphone, to each other: within 1 dB."""
    scene = _scene((*ABOVE[:3], 0.0))
    head = in_air(11.0, scene.drum)
    f_Hz = sorted({round(float(f), 6) for f in head.f_Hz})
    apart = [f for f in f_Hz if all(abs(f - other) > 0.04 * f for other in f_Hz if other != f) and f < 800.0]
    meshed = dataclasses.replace(scene, modal=None, mesh=Mesh(rate_Hz=RATE))
    difference = _levels_of_partials(scene, apart) - _levels_of_partials(meshed, apart)
    assert len(apart) >= 5
    assert np.abs(difference - np.median(difference)).max() < 1.0, difference


def test_without_microphones_nothing_reads_places() -> None:
    engine = new_engine(_scene(), RATE, StrikeRing())
    assert engine.modal is not None
    assert engine.modal.left_by_displacement is None
    out = np.zeros((64, 2), np.float32)
    render_all(engine, out, 64, 0)
    assert not out.any()
