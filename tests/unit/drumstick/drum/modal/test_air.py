"""A head in air, beside what was published, what a dense sum of Rayleigh's integral gives, and closed forms."""

import dataclasses
import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh
from scipy.special import jv

from drumstick.drum.block import render_all
from drumstick.drum.build import Unplayable, new_engine
from drumstick.drum.calibrate import build, full_scale, strike_for_speed
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.kettle import KettleTable
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.air_load import SOUND_M_PER_S, InAir, in_air, zero_at
from drumstick.drum.modal.building import bank_of, divisor_below, highest_zero
from drumstick.drum.modal.modes import shapes_at
from drumstick.drum.render import render
from drumstick.parameters.drum import Drum, Modal
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import SceneError, parse, shipped_text
from mallets import with_mallet
from published import DRUMS

RATE = 48_000
J01 = 2.404825557695773
# A 65 cm timpano's head without and with its kettle, (m,1) over (1,1), m = 2 .. 5.
WITHOUT_KETTLE, WITH_KETTLE = (DRUMS[name]["ratios"][1:] for name in ("timpano_without_kettle", "timpano"))
TIMPANO = {"radius_m": 0.328, "t60_s": 60.0}
HEAD = AirTable(1.204, 0.262)
BOWL = KettleTable(0.14 / (math.pi * 0.328**2))  # 0.14 m^3


def first_of(found: InAir, values: npt.NDArray[np.float64], orders: int) -> npt.NDArray[np.float64]:
    """Values of the modes (m,1), m below `orders`."""
    return np.array([values[found.modes.orders == order][0] for order in range(orders)])


def timpano(f01_Hz: float = 80.7, top_Hz: float = 1000.0, **effects: object) -> InAir:
    drum = Drum(f01_Hz=f01_Hz, effects={"air": HEAD, **effects}, **TIMPANO)
    return in_air(zero_at(top_Hz, drum), drum)


def cents(ratio: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return 1200.0 * np.log2(ratio)


def test_ratios_without_a_kettle_are_the_published_ones_within_twenty_cents() -> None:
    found = timpano()
    f_Hz = first_of(found, found.f_Hz, 6)
    assert np.abs(cents(f_Hz[2:] / f_Hz[1] / WITHOUT_KETTLE)).max() < 20.0
    ideal = first_of(found, found.modes.zeros, 6)
    assert np.abs(cents(ideal[2:] / ideal[1] / WITHOUT_KETTLE)).min() > 100.0  # in vacuum


def test_ratios_with_a_kettle_are_the_published_ones_within_a_hundredth() -> None:
    found = timpano(128.5, kettle=BOWL)
    f_Hz = first_of(found, found.f_Hz, 6)
    assert f_Hz[0] == pytest.approx(128.5)
    assert np.abs(f_Hz[2:] / f_Hz[1] / WITH_KETTLE - 1.0).max() < 0.01


def test_the_thump_is_short_and_the_ring_is_long() -> None:
    for found in (timpano(), timpano(128.5, kettle=BOWL)):
        t60_s = 3.0 * math.log(10.0) / first_of(found, found.decays, 4)
        assert t60_s[0] < 0.4
        assert t60_s[2] > 5.0 * t60_s[0]
        assert sorted(t60_s) == t60_s.tolist()


@pytest.mark.parametrize("f01_Hz", [40.0, 80.7, 150.0])
@pytest.mark.parametrize("effects", [{}, {"kettle": KettleTable(1.0)}], ids=["open", "kettle"])
def test_what_sounds_lowest_of_the_round_ones_is_f01(f01_Hz: float, effects: dict[str, object]) -> None:
    try:
        assert timpano(f01_Hz, 400.0, **effects).f_Hz[0] == pytest.approx(f01_Hz, rel=1e-6)
    except ValueError as error:
        assert effects
        assert f"the lowest mode would lie above f01_Hz = {f01_Hz:g} Hz: raise depth_m" in str(error)
        assert f01_Hz < 60.0


def test_a_kettle_so_shallow_that_its_spring_swaps_two_modes_loses_none() -> None:
    """Beside a scan of the eigenvalues of the head alone over all frequencies, by coth and cot in closed form."""
    found = timpano(80.0, 400.0, kettle=KettleTable(0.3))
    assert np.sort(found.f_Hz[found.modes.orders == 0])[:3] == pytest.approx([80.0, 128.5, 162.8], rel=4e-3)


def test_no_mode_is_played_beyond_what_a_step_can_carry() -> None:
    """Shorter steps where a kettle holds a mode far above the highest that is asked for."""
    stiff = Drum(
        radius_m=0.2325,
        f01_Hz=330.84,
        effects={"air": AirTable(4.29, 0.201), "kettle": KettleTable(0.052)},
        t60_s=1.0,
    )
    high = Drum(f01_Hz=1000.0)
    for drum, top_Hz in ((stiff, 469.0), (high, 200.0)):
        scene = Scene("high", drum=drum, modal=Modal(top_Hz))
        step_s = divisor_below(scene, RATE) / RATE
        highest_Hz = in_air(highest_zero(scene, 1.0 / step_s), drum).f_Hz.max()
        assert highest_Hz > top_Hz
        assert highest_Hz * step_s < 0.5
        bank = bank_of(scene, step_s)
        assert (bank.stiffness[: 2 * len(bank.orders)] > 0.0).all()


def test_without_density_it_is_the_drum_in_vacuum_bit_for_bit() -> None:
    scene = Scene("drum", modal=Modal(3000.0))
    airless = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects={"air": AirTable(0.0)}))
    for name, values in bank_of(scene, 1.0 / RATE)._asdict().items():
        np.testing.assert_array_equal(getattr(bank_of(airless, 1.0 / RATE), name), values, err_msg=name)


def _by_rayleighs_integral(heavy: float, across: int = 43) -> tuple[npt.NDArray[np.float64], float]:
    # By how much the air lowers the first modes of a head, at frequencies far below the air's: heights at points of a
    # square grid, each heavier by rho/(pi r) of every other, r apart. Knows nothing of transforms or of modes. And by
    # how much more (0,1) stands at half the radius, to its middle, than without air.
    h = 2.0 / across
    axis = (np.arange(across) + 0.5) * h - 1.0
    x, y = (values.ravel() for values in np.meshgrid(axis, axis))
    inside = np.hypot(x, y) < 1.0
    number = np.full(across * across, -1)
    number[inside] = np.arange(inside.sum())
    stiff = 4.0 * np.eye(inside.sum())
    grid = number.reshape(across, across)
    for one, other in ((grid[:, 1:], grid[:, :-1]), (grid[1:], grid[:-1])):
        both = (one >= 0) & (other >= 0)
        stiff[one[both], other[both]] = stiff[other[both], one[both]] = -1.0
    apart = np.hypot(x[inside, None] - x[inside], y[inside, None] - y[inside])
    np.fill_diagonal(apart, 1.0)
    near = h**2 / apart
    np.fill_diagonal(near, 4.0 * math.log(1.0 + math.sqrt(2.0)) * h)
    mass = np.eye(inside.sum()) + heavy / (2.0 * math.pi) * near
    lowest = [0, 5]
    (loaded, shaped), (alone, bare) = (
        eigh(stiff, m, subset_by_index=lowest) for m in (mass, np.eye(len(mass)))
    )
    r = np.hypot(x[inside], y[inside])
    middle, half = r < 0.1, np.abs(r - 0.5) < 0.03
    flat = [abs(shape[half, 0].mean() / shape[middle, 0].mean()) for shape in (shaped, bare)]
    return np.sqrt(loaded / alone), flat[0] - flat[1]


def test_the_airs_mass_is_that_of_rayleighs_integral() -> None:
    """A small and slow head, far below the air's own waves; the modes (0,1), (1,1) twice, (2,1) twice, (0,2)."""
    radius_m, air = 0.01, AirTable(1.2, 0.05)
    heavy = 2.0 * air.density_kg_per_m3 * radius_m / air.head_kg_per_m2
    witness, flatter = _by_rayleighs_integral(heavy)
    drum = Drum(radius_m=radius_m, f01_Hz=20.0, effects={"air": air})
    found = in_air(20.0, drum)
    lowered = np.sort(2.0 * math.pi * found.f_Hz / (found.c * found.modes.zeros))
    by_mode = {
        (order, number): float(
            2.0 * math.pi * found.f_Hz[own[number]] / (found.c * found.modes.zeros[own[number]])
        )
        for order in (0, 1, 2)
        for own in [np.flatnonzero(found.modes.orders == order)]
        for number in (0, 1)
    }
    expected = [by_mode[0, 0], by_mode[1, 0], by_mode[1, 0], by_mode[2, 0], by_mode[2, 0], by_mode[0, 1]]
    assert lowered[0] < 0.9
    np.testing.assert_allclose((1.0 - witness) / (1.0 - np.array(expected)), 1.0, atol=0.03)
    ideal = shapes_at(found.basis, 0.5, 0.0)[0], shapes_at(found.basis, 0.0, 0.0)[0]
    half, middle = (found.mixed(shape)[0] for shape in ideal)
    ours = half / middle - ideal[0][0] / ideal[1][0]
    assert flatter > 0.002
    assert ours == pytest.approx(flatter, rel=0.2)


def test_a_light_head_radiates_as_a_small_source_in_a_wall() -> None:
    """rho c0 k^2 S^2/(2 pi) on each side, S the volume it moves (Morse and Ingard, 7.4), while k a is small."""
    air, radius_m, f01_Hz = AirTable(1e-4, 0.5), 0.05, 60.0
    found = in_air(10.0, Drum(radius_m=radius_m, f01_Hz=f01_Hz, effects={"air": air}))
    k = 2.0 * math.pi * f01_Hz / SOUND_M_PER_S
    moved = 2.0 * math.pi * radius_m**2 * jv(1, J01) / J01
    resistance = 2.0 * air.density_kg_per_m3 * SOUND_M_PER_S * (k * moved) ** 2 / (2.0 * math.pi)
    mass = air.head_kg_per_m2 * math.pi * radius_m**2 * jv(1, J01) ** 2
    assert k * radius_m < 0.1
    assert found.decays[0] == pytest.approx(resistance / (2.0 * mass), rel=3e-3)


def test_a_mode_that_is_solved_with_its_order_is_where_it_would_stand_alone_in_the_end() -> None:
    """Four cents at the border between the two; below, where waves are long, they are far apart."""
    found = timpano(top_Hz=2700.0)
    zeros, turns = found.modes.zeros, 2.0 * math.pi * found.f_Hz
    narrow = np.sqrt(zeros**2 - (turns * TIMPANO["radius_m"] / SOUND_M_PER_S) ** 2)
    heavy = 2.0 * HEAD.density_kg_per_m3 * TIMPANO["radius_m"] / HEAD.head_kg_per_m2
    off = np.abs(cents(turns / (found.c * zeros / np.sqrt(1.0 + heavy / narrow))))
    assert off[(zeros > 37.0) & (zeros < 40.0)].max() < 4.0
    assert off[zeros > 40.0].max() < 1e-6
    assert off[0] > 50.0


@pytest.mark.daily("kettle")
@pytest.mark.parametrize("bowl", [False, True], ids=["open", "kettle"])
@settings(max_examples=6)
@given(
    st.floats(0.05, 1.0),
    st.floats(20.0, 800.0),
    st.floats(0.05, 2.0),
    st.floats(0.1, 10.0),
    st.floats(0.05, 2.0),
)
def test_any_head_in_any_air_is_a_bank_that_fades_or_is_refused_in_words(
    bowl: bool, radius_m: float, f01_Hz: float, head: float, density: float, depth_m: float
) -> None:
    effects: dict[str, object] = {"air": AirTable(density, head)}
    if bowl:
        effects["kettle"] = KettleTable(depth_m)
    drum = Drum(radius_m=radius_m, f01_Hz=f01_Hz, effects=effects)
    try:
        found = in_air(30.0, drum)
    except ValueError as error:
        assert "f01_Hz" in str(error)
        return
    assert np.isfinite(found.f_Hz).all()
    assert found.f_Hz[0] == pytest.approx(f01_Hz, rel=2e-3)
    for order in np.unique(found.modes.orders):  # each mode once
        own = np.sort(found.f_Hz[found.modes.orders == order])
        assert own[0] > 0.0
        assert (np.diff(own) > 0.01 * own[1:]).all()
    assert (found.decays >= 0.0).all()
    assert (found.masses >= 1.0 - 1e-9).all()


def test_it_plays_and_fades_by_a_strike_and_by_a_mallet() -> None:
    scene = Scene("timpano", modal=Modal(2000.0))
    drum = dataclasses.replace(
        scene.drum, f01_Hz=128.5, radius_m=0.328, effects={"air": HEAD, "kettle": BOWL}
    )
    for which in (dataclasses.replace(scene, drum=drum), with_mallet(dataclasses.replace(scene, drum=drum))):
        ring = StrikeRing()
        engine = build(which, RATE, ring)
        assert engine.modal is not None
        blow, out = full_scale(which), np.zeros((3 * RATE, 2), np.float32)
        ring.push_blow(blow)
        render_all(engine, out, 128, 0)
        loud = [float(np.abs(out[at : at + RATE // 2]).max()) for at in (0, RATE, 5 * RATE // 2)]
        assert loud[0] > loud[1] > loud[2] > 0.0
        assert np.isfinite(out).all()


@pytest.mark.daily("timpani-*")
@pytest.mark.parametrize("stroke_m_per_s", [1.0, 2.0, 3.0])
@pytest.mark.parametrize(("name", "tuned_Hz"), [("timpani", 130.813), ("low-timpani", 97.999)])
def test_the_shipped_timpani_are_heard_at_their_pitch_under_a_felt_mallet(
    name: str, tuned_Hz: float, stroke_m_per_s: float
) -> None:
    """At three quarters of the radius (1,1) is within 6 dB of the loudest partial from 0.3 s on."""
    scene = parse(shipped_text(name), name)
    found = in_air(20.0, scene.drum)
    pitch_Hz = first_of(found, found.f_Hz, 2)[1]
    assert np.abs(cents(pitch_Hz / tuned_Hz)) < 2.0
    blow = strike_for_speed(scene, stroke_m_per_s, 0.75, 0.0)
    sound = render(scene, [blow], 1.4, RATE)[round(0.3 * RATE) :, 0].astype(float)
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound)), 1 << 19))
    f_Hz = np.fft.rfftfreq(1 << 19, 1.0 / RATE)
    assert spectrum[np.abs(f_Hz - pitch_Hz) < 2.0].max() > 10.0 ** (-6.0 / 20.0) * spectrum.max()


def test_what_cannot_be_is_said() -> None:
    fast = Scene("fast", drum=Drum(f01_Hz=900.0, radius_m=0.4, effects={"air": HEAD}), modal=Modal(2000.0))
    with pytest.raises(Unplayable, match="as fast as sound"):
        new_engine(fast, RATE, StrikeRing())
    with pytest.raises(SceneError, match=r"drum.effects.kettle.*needs \[modal\]"):
        parse("[drum.effects.air]\n[drum.effects.kettle]\n", "mesh")
    with pytest.raises(SceneError, match="too loud at microphones"):
        parse("[listen]\nmicrophones = [[0.0, 0.0, 1.0, 0.0]]\n[drum.effects.air]\n", "mesh")
    with pytest.raises(SceneError, match=r"drum.effects.kettle.*needs \[drum.effects.air\]"):
        parse("[modal]\n[drum.effects.kettle]\n", "no air")
