"""Wires on the head: the one solution of their meeting, strings of the right pitch, and a strainer that is turned."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.snare import solve_overlap
from drumstick.drum.engine import Engine, set_live
from drumstick.drum.length_unit import metres_per_unit_in_air
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from membranes import energy
from stability.mesh_steps import RATE, engine_of, strike, take

NUMBERS = st.floats(-10.0, 10.0)


def touching(before: float, after: float) -> float:
    """2/K times the discrete gradient of K/2 [eta]+^2, from its definition."""
    if after == before:
        return 2.0 * max(after, 0.0)
    return (max(after, 0.0) ** 2 - max(before, 0.0) ** 2) / (after - before)


@given(NUMBERS, NUMBERS, st.floats(1e-3, 1e3))
def test_the_meeting_solves_its_equation(before: float, free: float, k: float) -> None:
    def wrong(after: float) -> float:
        return after - free + k * touching(before, after)

    after = solve_overlap(before, free, k)
    size = abs(before) + abs(free) + 1e-3
    assert abs(wrong(after)) <= 1e-9 * size * (1.0 + k)
    far = (1.0 + k) * 20.0 * size
    assert after == pytest.approx(brentq(wrong, -far, far, xtol=1e-12 * size), abs=1e-7 * size)


@given(NUMBERS, NUMBERS, st.floats(1e-3, 1e3))
def test_a_push_gives_back_what_it_stored_and_no_more(before: float, free: float, k: float) -> None:
    """Work over the way from eta- to eta+ is the change of K/2 [eta]+^2, to rounding."""
    after = solve_overlap(before, free, k)
    push = (free - after) / k
    stored = max(after, 0.0) ** 2 - max(before, 0.0) ** 2
    assert push * (after - before) == pytest.approx(stored, abs=1e-7 * (1.0 + before**2 + free**2))
    assert push >= -1e-9 * (1e-3 + abs(before) + abs(free)), "wires push, they never pull"


def test_apart_stays_apart() -> None:
    assert solve_overlap(-1.0, -0.5, 3.0) == -0.5
    assert np.isfinite(solve_overlap(0.0, 0.0, 1.0))


def snare(rate_Hz: float = 24_000.0, **changed: float) -> Scene:
    """The shipped snare, struck by pulses, with other wires."""
    scene = parse(shipped_text("snare"), "snare.toml")
    effects = dict(scene.drum.effects)
    effects["snare"] = dataclasses.replace(effects["snare"], **changed)
    return dataclasses.replace(
        scene,
        drum=dataclasses.replace(scene.drum, effects=effects, excitation="analytic"),
        mallet=None,
        strike=dataclasses.replace(scene.strike, stroke_m_per_s=0.0),
        mesh=dataclasses.replace(scene.mesh, rate_Hz=rate_Hz),
    )


def lying(scene: Scene) -> Engine:
    """Its engine, awake, the wires pressed on as the scene says."""
    return engine_of(scene, presses=False)


def step_s_of(engine: Engine) -> float:
    return float(engine.control["divisor"][0] / engine.control["rate_Hz"][0])


def free_pitch(scene: Scene, periods: int = 6) -> float:
    """Pitch, Hz, of a wire that is plucked far from the head."""
    engine = lying(scene)
    wires = engine.effects.snare
    wires.state["eta_0"], wires.state["loss"] = -1e9, 1.0
    wires.places[:] = np.sin(np.pi * np.linspace(0.0, 1.0, wires.places.shape[2]))
    crossed: list[float] = []  # in steps
    before = 0.0
    for step in range(100_000):
        take(engine, 1)
        height = float(wires.places[int(engine.control["present_level"][0]), 0, wires.places.shape[2] // 2])
        if before * height < 0.0:
            crossed.append(step + before / (before - height))
        if len(crossed) > 2 * periods:
            return (len(crossed) - 1) / 2.0 / (crossed[-1] - crossed[0]) / step_s_of(engine)
        before = height
    raise AssertionError("it does not swing")


@pytest.mark.parametrize("tension_N", [2.0, 200.0])
def test_a_wire_by_itself_sounds_as_a_string_does(tension_N: float) -> None:
    """c/(2 L) of 3 g/m over 0.85 of the head, whether its points lie a junction apart or several."""
    scene = snare(g_per_m=3.0, tension_N=tension_N)
    by_law = math.sqrt(tension_N / 3e-3) / (4.0 * 0.85 * scene.drum.radius_m)
    assert free_pitch(scene) == pytest.approx(by_law, rel=5e-3)
    for strainer, share in ((0.25, 0.25), (0.01, 0.1)):  # a tenth of the pull is left to a loose one
        turned = snare(g_per_m=3.0, tension_N=tension_N, strainer=strainer)
        assert free_pitch(turned) == pytest.approx(by_law * math.sqrt(share), rel=5e-3)


def test_a_wire_by_itself_dies_away_in_its_own_time() -> None:
    engine = lying(snare(t60_s=0.1, tension_N=200.0))
    wires = engine.effects.snare
    wires.state["eta_0"] = -1e9
    wires.places[:] = np.sin(np.pi * np.linspace(0.0, 1.0, wires.places.shape[2]))

    def loudest() -> float:
        found = 0.0
        for _ in range(round(0.02 / step_s_of(engine))):
            take(engine, 1)
            found = max(found, float(np.abs(wires.places[0, 0]).max()))
        return found

    first = loudest()
    take(engine, round(0.03 / step_s_of(engine)))
    assert 20.0 * math.log10(loudest() / first) == pytest.approx(-30.0, abs=1.0)


def test_pressure_contact_and_gap_are_those_of_the_scene_in_newtons_and_metres() -> None:
    """8 T b/L^2 along the wire; on something rigid it swings at 6 kHz; off, it hangs 5 mm below the head."""
    scene = snare(wires=3, tension_N=4.0, bed_mm=0.2, g_per_m=3.0)
    engine = lying(scene)
    part, head = engine.effects.snare, engine.effects.cavity
    state = {name: float(part.state[name][0]) for name in part.state.dtype.names}
    unit_m, step_s = metres_per_unit_in_air(scene), step_s_of(engine)
    junction_kg = 0.2 * math.pi * scene.drum.radius_m**2 * float(head.state["per_area_2"][0])
    pushes_N = state["stiffness"] * state["eta_0"] * junction_kg * unit_m / step_s**2
    length_m = 1.7 * scene.drum.radius_m
    pieces = part.places.shape[2] - 1
    assert pushes_N * pieces == pytest.approx(8.0 * 4.0 * 0.2e-3 / length_m, rel=1e-6)
    assert math.sqrt(state["stiffness"] / state["mass"]) / step_s == pytest.approx(2.0 * math.pi * 6000.0)
    assert state["gap"] * unit_m == pytest.approx(0.005)


@pytest.mark.parametrize("tension_N", [3.0, 200.0])
def test_they_lie_across_the_middle(tension_N: float) -> None:
    scene = snare(tension_N=tension_N, g_per_m=0.5)
    engine = lying(scene)
    part, grid = engine.effects.snare, engine.effects.cavity.head.grid[0]
    apart = int(part.state["apart"][0])
    assert (apart == 1) == (tension_N == 3.0)
    under = part.first[:, None] + apart * np.arange(part.places.shape[2] - 2)
    rows, columns = np.divmod(under, int(grid["stride"]))
    across = (columns - int(grid["centre_column"])) * float(grid["spacing"])
    piece = apart * float(grid["spacing"])
    assert across[:, 0] == pytest.approx(-0.85 + piece, abs=piece)
    assert across[:, -1] == pytest.approx(0.85 - piece, abs=1.5 * piece)
    rows_aside = (
        float(np.abs(rows - int(grid["centre_row"])).max()) * math.sqrt(0.75) * float(grid["spacing"])
    )
    assert 0.2 - float(grid["spacing"]) < rows_aside <= 0.2
    assert (rows - int(grid["centre_row"])).tolist() == (-(rows - int(grid["centre_row"]))[::-1]).tolist()


@pytest.mark.parametrize("tension_N", [3.0, 200.0])
def test_energy_never_grows_whether_points_lie_a_junction_apart_or_several(tension_N: float) -> None:
    engine = lying(snare(tension_N=tension_N, g_per_m=0.5))
    strike(engine, 10.0)
    take(engine, round(0.004 / step_s_of(engine)))
    held = [energy(engine)]
    for _ in range(200):
        take(engine, 3)
        held.append(energy(engine))
    assert np.max(np.diff(held)) <= 2e-6 * held[0]
    assert held[-1] > 0.0


@pytest.mark.parametrize("bed_mm", [0.0, 0.084, 2.0])
def test_without_losses_wires_and_heads_keep_their_energy(bed_mm: float) -> None:
    """Strokes that lift the wires off and let them fall back, a hundred times. What is left is float32's rounding."""
    scene = snare(bed_mm=bed_mm, t60_s=10.0)
    effects = {name: effect for name, effect in scene.drum.effects.items() if name in ("cavity", "snare")}
    effects["cavity"] = dataclasses.replace(effects["cavity"], t60_s=math.inf)
    engine = lying(
        dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects=effects, t60_s=math.inf))
    )
    engine.effects.snare.state["loss"] = 1.0
    strike(engine, 10.0)
    take(engine, round(0.004 / step_s_of(engine)))
    first, wires = energy(engine), 0.0
    for _ in range(100):
        take(engine, 3)
        assert energy(engine) == pytest.approx(first, rel=2e-6)
        wires = max(wires, float(np.abs(engine.effects.snare.places).max()))
    assert wires > 0.0


def test_a_wire_so_fast_that_a_step_cannot_follow_it_is_slowed() -> None:
    scene = snare(4000.0, g_per_m=0.1, tension_N=200.0)
    engine = lying(dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, radius_m=0.05)))
    assert float(engine.effects.snare.state["spring"][0]) <= 1.0


def test_wires_pressed_on_hard_fall_asleep_with_the_head() -> None:
    engine = lying(snare(bed_mm=10.0, tension_N=200.0, t60_s=0.05))
    strike(engine, 1e-3)
    take(engine, round(4.0 / step_s_of(engine)))
    assert int(engine.control["asleep"][0]) == 1
    assert not engine.effects.snare.places.any()
    assert not engine.effects.snare.etas.any()


def second_head(scene: Scene, peak_N: float) -> np.ndarray:
    """Planes of the second head 400 steps after a blow of so many newtons, per newton."""
    engine = lying(scene)
    strike(engine, peak_N)
    take(engine, 400)
    return engine.effects.cavity.head.time_levels.astype(float) / peak_N


def test_a_wire_rattles_only_as_far_as_it_is_not_pressed_on() -> None:
    """Deep in the bed nothing lifts off, and twice the blow gives twice the movement; loose wires make no such sum."""
    fast = snare(bed_mm=10.0, tension_N=200.0)
    soft, hard = second_head(fast, 1.0), second_head(fast, 2.0)
    np.testing.assert_allclose(soft, hard, rtol=0.0, atol=1e-4 * np.abs(soft).max())
    loose = snare(bed_mm=0.001)
    soft, hard = second_head(loose, 1.0), second_head(loose, 2.0)
    assert np.abs(soft - hard).max() > 1e-2 * np.abs(soft).max()


def test_the_blow_at_which_they_lift_off_goes_with_the_bed() -> None:
    """Twice as deep a bed rattles at twice the blow in the very same way: the bed is the only length there is."""
    np.testing.assert_allclose(
        second_head(snare(bed_mm=0.02), 1.0), second_head(snare(bed_mm=0.04), 2.0), rtol=0.0, atol=1e-6
    )


@pytest.mark.parametrize("rate_Hz", [8000.0, 24000.0, 48000.0])
@pytest.mark.parametrize("wires", [1, 2, 12, 42])
def test_no_junction_lies_under_two_wires_and_all_of_them_are_there(rate_Hz: float, wires: int) -> None:
    scene = snare(rate_Hz, wires=wires, g_per_m=3.0)
    engine = lying(scene)
    part, cavity = engine.effects.snare, engine.effects.cavity
    points = part.places.shape[2] - 2
    under = part.first[:, None] + int(part.state["apart"][0]) * np.arange(points)
    assert len(np.unique(under)) == under.size
    assert (cavity.head.weights[under] > 0.0).all()
    # In kg: junctions of a head of 0.2 kg/m^2, and a wire of 3 g/m over 0.85 of the diameter, ends not counted.
    junction_kg = 0.2 * math.pi * scene.drum.radius_m**2 * float(cavity.state["per_area_2"][0])
    of_all = float(part.state["mass"][0]) * len(part.first) * (points + 1) * junction_kg
    assert of_all == pytest.approx(wires * 3e-3 * 1.7 * scene.drum.radius_m, rel=1e-6)


def test_wires_that_are_off_are_not_there() -> None:
    scene = snare(strainer=0.0)
    effects = {name: effect for name, effect in scene.drum.effects.items() if name != "snare"}
    bare = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects=effects))
    np.testing.assert_array_equal(second_head(scene, 1.0), second_head(bare, 1.0))
    assert np.abs(second_head(scene, 1.0) - second_head(snare(), 1.0)).max() > 0.0


def test_the_strainer_goes_the_whole_way_in_a_tenth_of_a_second_and_back() -> None:
    engine = lying(snare())
    state = engine.effects.snare.state
    steps = round(0.1 / step_s_of(engine))
    for wanted, end in ((0.0, -1.0), (0.6, 0.6), (5.0, 1.0)):
        set_live(engine, "strainer", wanted)
        strike(engine, 1.0)
        seen = [float(state["tight"][0])]
        for _ in range(steps + 2):
            take(engine, 1)
            seen.append(float(state["tight"][0]))
        assert seen[-1] == end
        assert np.abs(np.diff(seen)).max() <= 2.0 / steps + 1e-9
        assert (np.diff(seen) * np.sign(end - seen[0]) >= 0.0).all()
        assert wanted > 0.0 or not engine.effects.snare.places.any()
    assert float(np.abs(engine.effects.snare.places).max()) > 0.0


def test_turned_at_random_while_it_rattles_the_drum_keeps_to_the_blows_energy() -> None:
    """Turning is work from outside, and there is little of it: a hundredth of a strong blow's at most."""
    engine, rng = lying(snare()), np.random.default_rng(4)
    strike(engine, 30.0)
    take(engine, round(0.004 / step_s_of(engine)))
    last = first = energy(engine)
    for _ in range(40):
        set_live(engine, "strainer", float(rng.choice([0.0, 0.02, 0.5, 1.0])))
        take(engine, round(0.01 / step_s_of(engine)))
        now = energy(engine)
        assert np.isfinite(now)
        assert now <= last + 0.01 * first
        last = now
    assert last < 0.1 * first


def test_what_was_set_while_nothing_sounded_holds_for_the_first_stroke() -> None:
    def heard(strainer: float, then_set: float) -> np.ndarray:
        ring = StrikeRing()
        engine = new_engine(snare(strainer=strainer), RATE, ring)
        out = np.zeros((RATE // 5, 2), np.float32)
        render_all(engine, out[: RATE // 50], 64, 0)  # silence, in which it is not computed
        set_live(engine, "strainer", then_set)
        ring.push(0, 0.3, 0.2, 5.0, 0.002, 0.0, 1.0)
        render_all(engine, out, 64, 0)
        return out

    for strainer in (0.0, 0.4):
        np.testing.assert_array_equal(heard(1.0, strainer), heard(strainer, strainer))
    assert np.abs(heard(1.0, 1.0) - heard(0.0, 0.0)).max() > 0.0
