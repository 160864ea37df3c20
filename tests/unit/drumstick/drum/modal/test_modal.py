"""The bank of modes: complete, exact, only what it needs, and stable in hard cases."""

import dataclasses
import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.special import jn_zeros, jv

from drumstick.drum.block import render_all
from drumstick.drum.build import describe_renderer, new_engine, size_of
from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.effects.rim import RimTable
from drumstick.drum.effects.uniform_loss import UniformLossTable
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.modal.bank import compute_strike_weights
from drumstick.drum.modal.building import MAX_MODES, MAX_MODES_STEP_BY_STEP, bank_of
from drumstick.drum.modal.modes import modes_below, shapes_at
from drumstick.drum.render import render
from drumstick.parameters.drum import Drum, Listen, Modal
from drumstick.parameters.scene import Scene
from mallets import with_mallet
from realtime.records import is_there

RATE = 48_000


def scene(top_Hz: float = 3000.0, **drum: float) -> Scene:
    listen = Listen(pickups=((0.43, 0.19, 0.0),))
    return Scene("drum", drum=Drum(**drum), modal=Modal(top_Hz=top_Hz), listen=listen)


def test_no_mode_is_missing() -> None:
    modes = modes_below(40.0)
    expected = sorted((float(j), m) for m in range(60) for j in jn_zeros(m, 20) if j <= 40.0)
    assert modes.zeros == pytest.approx([j for j, _ in expected], abs=1e-9)
    assert modes.orders.tolist() == [m for _, m in expected]


def test_norms_are_the_integral_of_the_shape_squared() -> None:
    modes = modes_below(12.0)
    r = (np.arange(4000) + 0.5) / 4000
    for order, zero, norm in zip(*modes, strict=True):
        ring = float(np.sum(jv(order, zero * r) ** 2 * r)) / 4000
        assert norm == pytest.approx(ring * (2.0 * math.pi if order == 0 else math.pi), rel=1e-4)


def test_a_strike_drives_every_mode_by_its_shape() -> None:
    """Speed that a force of 1 N gives each in a step, true to a thousandth of the most that it can give that mode."""
    which = scene(top_Hz=8000.0)
    bank = bank_of(which, 1.0 / RATE)
    modes = modes_below(8000.0 / which.drum.f01_Hz * J01)
    f_Hz = which.drum.f01_Hz * modes.zeros / J01
    theta = 2.0 * math.pi * f_Hz / RATE
    left = np.exp(-3.0 * math.log(10.0) / which.drum.t60_s / RATE)
    c = 2.0 * math.pi * which.drum.f01_Hz / J01  # radii a second
    drive = np.tile((c / RATE) ** 2 / modes.norms * np.sin(theta) / theta / left, 2)
    for x, y in ((0.0, 0.0), (0.2, -0.7), (-0.99, 0.05), (0.31, 0.0), (0.0, 1.0), (-1.0, -1.0)):
        compute_strike_weights(bank, 1, x, y)
        ideal = np.concatenate(shapes_at(modes, x, y))
        assert np.abs(bank.strike_weights[1, : len(drive)] / drive - ideal).max() < 1e-3


def rung(which: Scene, x: float, y: float, frames: int) -> npt.NDArray[np.float64]:
    return render(which, [OfflineStrike(0.0, x, y, 2.0, 0.003)], frames / RATE, RATE)[:, 0].astype(float)


def test_the_sound_is_the_sum_of_the_modes_in_closed_form() -> None:
    """After the blow each mode turns and fades by itself: the whole waveform, to one constant of level and delay."""
    which = scene(top_Hz=1500.0, f01_Hz=150.0, t60_s=0.8)
    sound = rung(which, 0.3, 0.4, 12_000)[2_000:]
    t = np.arange(len(sound)) / RATE
    columns: list[npt.NDArray[np.float64]] = []
    for zero in modes_below(1500.0 / 150.0 * J01).zeros:
        w = 2.0 * math.pi * 150.0 * zero / J01
        fade = np.exp(-3.0 * math.log(10.0) / 0.8 * t)
        columns += [fade * np.cos(w * t), fade * np.sin(w * t)]
    basis = np.stack(columns, axis=1)
    fitted = basis @ np.linalg.lstsq(basis, sound, rcond=None)[0]
    assert np.abs(sound - fitted).max() < 1e-4 * np.abs(sound).max()


def test_bank_and_mesh_sound_alike() -> None:
    """Calibrated both: levels of one blow within 1.5 dB.

    Both peak at the same height, and the peak of a damped blow, which begins with a jump, has the highest modes in it:
    those above 4 kHz are the mesh's alone. Below 2 kHz the levels are 0.4 dB apart.
    """
    with_modes = scene(top_Hz=4000.0)
    with_mesh = dataclasses.replace(with_modes, modal=None)
    loudness = [np.sqrt(np.mean(rung(which, 0.3, 0.4, RATE // 2) ** 2)) for which in (with_modes, with_mesh)]
    assert 20.0 * abs(math.log10(loudness[0] / loudness[1])) < 1.5


def test_an_engine_of_modes_has_nothing_of_a_mesh() -> None:
    engine = build(scene(), RATE, StrikeRing())
    assert engine.head is None
    assert engine.laplacian is None
    assert set(engine.effects._fields) == {
        "internal_loss",
        "muffle",
        "tension",
        "cavity",
        "snare",
        "sympathy",
        "rim",
        "air",
    }
    assert not any(is_there(part) for part in engine.effects)
    assert engine.modal is not None
    assert describe_renderer(engine) == f"bank of {size_of(engine)} modes at 9600 Hz"


@pytest.mark.long
def test_a_low_drum_has_as_many_modes_as_there_is_room_for() -> None:
    """There is more where they are taken in blocks: a drum of 100 Hz up to 20 kHz."""
    free = scene(top_Hz=20_000.0, f01_Hz=60.0)
    for which, most in ((free, MAX_MODES), (with_mallet(free), MAX_MODES_STEP_BY_STEP)):
        engine = new_engine(which, RATE, StrikeRing())
        assert 0.95 * most < size_of(engine) < 1.05 * most
    whole = new_engine(scene(top_Hz=20_000.0, f01_Hz=100.0), RATE, StrikeRing())
    assert size_of(whole) == 57_740


def test_it_comes_to_rest_and_is_struck_again() -> None:
    ring = StrikeRing()
    which = scene(t60_s=0.05)
    engine = build(which, RATE, ring)
    blow = full_scale(which)
    out = np.zeros((2 * RATE, 2), np.float32)
    for _ in range(2):
        ring.push(0, 0.3, 0.3, blow.peak_N, blow.contact_s)
        render_all(engine, out, 128, 0)
        assert np.abs(out[: RATE // 10]).max() > 0.05
        assert engine.control["asleep"][0] == 1
        assert not engine.modal.q.any()  # type: ignore[union-attr]


@pytest.mark.parametrize("peak_N", [1e6, 1e-30, 0.0])
def test_hard_blows_stay_finite(peak_N: float) -> None:
    ring = StrikeRing()
    engine = build(scene(t60_s=60.0), RATE, ring)
    out = np.zeros((RATE // 2, 2), np.float32)
    for place in range(32):
        ring.push(0, math.cos(place), math.sin(place), peak_N, 1e-6 * 10.0 ** (place % 6))
    render_all(engine, out, 128, 0)
    assert np.isfinite(out).all()
    assert np.abs(out).max() <= 1.0


def test_it_fades_by_its_law_for_twenty_seconds() -> None:
    """The longest that a scene can ask for, the head's own and the uniform loss's 60 s each: 20 dB in ten seconds."""
    plain = scene(t60_s=60.0)
    which = dataclasses.replace(
        plain, drum=dataclasses.replace(plain.drum, effects={"uniform_loss": UniformLossTable(60.0)})
    )
    ring = StrikeRing()
    engine = build(which, RATE, ring)
    blow = full_scale(which)
    ring.push(0, 0.0, 0.0, blow.peak_N, blow.contact_s)
    out = np.zeros((RATE, 2), np.float32)
    levels: list[float] = []
    for _ in range(22):
        render_all(engine, out, 128, 0)
        levels.append(float(np.sqrt(np.mean(out.astype(float) ** 2))))
    falls_dB = 20.0 * np.log10(np.array(levels[1:11]) / levels[11:21])
    assert falls_dB == pytest.approx(np.full(10, 20.0), abs=0.1)


def test_the_rim_sounds_beside_the_modes() -> None:
    plain = scene()
    hooped = dataclasses.replace(plain, drum=dataclasses.replace(plain.drum, effects={"rim": RimTable()}))
    quiet, loud = (np.abs(rung(which, 0.98, 0.0, RATE // 10)).max() for which in (plain, hooped))
    assert loud > 1.5 * quiet
