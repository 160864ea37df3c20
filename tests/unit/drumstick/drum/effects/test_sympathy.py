"""Buzz from a neighbour's strike: what a drum hears of others, what it makes of it, and that it is given all of it."""

import dataclasses
import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.rim import RimTable
from drumstick.drum.effects.snare import SnareTable
from drumstick.drum.effects.sympathy import SympathyTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.effects.uniform_loss import UniformLossTable
from drumstick.drum.engine import Engine, hearing, hears_others
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from membranes import energy, second_head
from realtime.records import is_there
from stability.mesh_steps import RATE, drum_of, engine_of, strike, take

Sound = npt.NDArray[np.float32]
STRUCK_S, HEARD_S = 0.05, 0.4
BESIDE: dict[str, st.SearchStrategy[object]] = {
    "air": st.builds(AirTable, st.floats(0.0, 3.0), st.floats(0.1, 2.0)),
    "uniform_loss": st.builds(UniformLossTable, st.floats(0.05, 60.0)),
    "internal_loss": st.builds(InternalLossTable, st.floats(0.01, 0.4), st.floats(4000.0, 20000.0)),
    "muffle": st.builds(MuffleTable, st.just(((0.4, 0.1, 0.4),)), st.floats(0.001, 10.0)),
    "tension": st.builds(TensionTable, st.floats(0.0, 1200.0)),
    "rim": st.builds(RimTable),
}


def snare(sympathy: SympathyTable | None, strainer: float = 1.0) -> Scene:
    scene = parse(shipped_text("snare"), "snare.toml")
    effects = dict(scene.drum.effects)
    effects["snare"] = dataclasses.replace(effects["snare"], strainer=strainer)
    if sympathy is not None:
        effects["sympathy"] = sympathy
    return dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects=effects))


@pytest.fixture(scope="module")
def tom() -> Sound:
    scene = parse(shipped_text("tom"), "tom.toml")
    blow = strike_for_speed(scene, scene.strike.full_scale_m_per_s, 0.3, 0.0, STRUCK_S)
    return render(scene, [blow], HEARD_S, RATE)


def heard(scene: Scene, neighbours: Sound | None) -> Sound:
    """Sound of the drum while nobody strikes it."""
    return render(scene, [], HEARD_S, RATE, neighbours=neighbours)


def band_level(sound: Sound, low_Hz: float, high_Hz: float) -> float:
    """In dB."""
    power = np.abs(np.fft.rfft(sound[:, 0].astype(float))) ** 2
    f_Hz = np.fft.rfftfreq(len(sound), 1.0 / RATE)
    return float(10.0 * np.log10(power[(f_Hz >= low_Hz) & (f_Hz < high_Hz)].sum()))


def test_it_is_silent_until_the_neighbours_sound_has_come(tom: Sound) -> None:
    begins = int(np.flatnonzero(tom.any(axis=1))[0])
    assert begins >= STRUCK_S * RATE - 200  # what the interpolator hears ahead
    came = [
        int(np.flatnonzero(heard(snare(SympathyTable(20.0, way_m)), tom).any(axis=1))[0])
        for way_m in (0.0, 3.43)
    ]
    assert came[0] >= begins
    assert came[1] - came[0] == pytest.approx(0.01 * RATE, abs=2.0)
    assert not heard(snare(SympathyTable()), None).any()


def test_the_wires_buzz_the_more_the_louder_the_neighbour_is_and_not_when_they_are_off(tom: Sound) -> None:
    """At 2 Pa they move with the head, at 20 they leave it: the upper octaves rise by far more than the neighbour does.
    Without them the drum only rings along, and all of it rises as the neighbour does."""
    pressures = (2.0, 20.0, 200.0)
    on, off = (
        [band_level(heard(snare(SympathyTable(Pa, 0.0), tight), tom), 4000.0, 16000.0) for Pa in pressures]
        for tight in (1.0, 0.0)
    )
    assert on[1] - on[0] > 40.0
    assert on[2] - on[1] > 10.0
    assert np.diff(off) == pytest.approx([20.0, 20.0], abs=1.0)
    assert on[0] - off[0] < 20.0
    assert min(on[1] - off[1], on[2] - off[2]) > 25.0


def test_a_drum_that_does_not_ask_for_it_is_the_same_and_has_nothing_of_it(tom: Sound) -> None:
    scene = snare(None)
    blow = strike_for_speed(scene, 1.0, 0.3, 0.1, 0.1)
    alone = render(scene, [blow], HEARD_S, RATE)
    assert alone.any()
    assert np.array_equal(alone, render(scene, [blow], HEARD_S, RATE, neighbours=tom))
    engine = build(scene, RATE, StrikeRing())
    assert not is_there(engine.effects.sympathy)
    assert not hears_others(engine)
    asked = snare(SympathyTable())
    for neighbours in (None, np.zeros_like(tom)):
        assert np.array_equal(alone, render(asked, [blow], HEARD_S, RATE, neighbours=neighbours))
    deaf = snare(SympathyTable(full_scale_Pa=0.0))
    assert np.array_equal(alone, render(deaf, [blow], HEARD_S, RATE, neighbours=tom))


def pushes(engine: Engine, sounds: npt.NDArray[np.float64]) -> None:
    """Lay them into the line, one for each of the coming steps."""
    part = engine.effects.sympathy
    assert int(part.state["way"][0]) == 0
    assert len(sounds) <= len(part.line)
    part.state["next"] = 0
    part.line[: len(sounds)] = sounds


def work_of(engine: Engine, pressure: float, before: Sound, after: Sound) -> float:
    """f (u+ - u-)/2, f being what moves each junction of the second head, in `energy`'s units."""
    second, _, _, loss_divisor, _ = second_head(engine.effects.cavity)
    state = engine.effects.cavity.state[0]
    ratio = float(state["per_area_2"]) / float(state["per_area_1"])
    moved = float(engine.effects.sympathy.state["push"][0]) * pressure * second.head.weights.astype(float)
    force = second.mass * moved * loss_divisor
    return ratio * float(np.sum(force * (after.astype(float) - before))) / 2.0


def never_more_than_given(engine: Engine, sounds: npt.NDArray[np.float64]) -> tuple[float, float]:
    """Play these sounds: the energy never grows by more than their work. The energy at the end, and that work."""
    held = top = energy(engine)
    given = 0.0
    for pressure in sounds:
        level = int(engine.control["present_level"][0])
        before = engine.effects.cavity.head.time_levels[1 - level].copy()
        take(engine, 1)
        work = work_of(engine, pressure, before, engine.effects.cavity.head.time_levels[1 - level])
        now = energy(engine)
        top = max(top, now)
        assert now <= held + work + 2e-6 * top
        held, given = now, given + work
    return held, given


@pytest.mark.parametrize("wires", [False, True])
def test_all_that_it_gets_is_the_work_that_the_sound_does(wires: bool) -> None:
    """Noise at 200 Pa on two heads, with wires that rattle and without, and silence after it."""
    effects: dict[str, object] = {
        "cavity": CavityTable(depth_m=0.1, f01_Hz=700.0, t60_s=60.0),
        "sympathy": SympathyTable(200.0, 0.0),
    }
    if wires:
        effects["snare"] = SnareTable(wires=20, bed_mm=0.01, t60_s=10.0)
    engine = engine_of(drum_of(effects), presses=False)
    assert is_there(engine.effects.cavity)
    sounds = np.concatenate([np.random.default_rng(3).uniform(-1.0, 1.0, 400), np.zeros(300)])
    pushes(engine, sounds)
    held, given = never_more_than_given(engine, sounds)
    assert 0.0 < held < given


@pytest.mark.daily("tension")
@pytest.mark.parametrize("beside", BESIDE)
@settings(max_examples=3)
@given(st.data(), st.floats(1.0, 200.0), st.floats(0.02, 2.0), st.floats(500.0, 2000.0))
def test_nor_more_beside_another_effect(
    beside: str, drawn: st.DataObject, full_scale_Pa: float, depth_m: float, f01_Hz: float
) -> None:
    """Any second head, and any values of the other effect: a blow on the first, noise on the second."""
    effects: dict[str, object] = {
        "cavity": CavityTable(depth_m=depth_m, f01_Hz=f01_Hz, t60_s=60.0),
        "sympathy": SympathyTable(full_scale_Pa, 0.0),
        beside: drawn.draw(BESIDE[beside]),
    }
    dull, small = beside == "internal_loss", beside == "air"
    scene = drum_of(effects, 60.0 if dull else math.inf, 1000.0, radius_m=0.04 if small else 0.16)
    engine = engine_of(scene)
    sounds = np.concatenate([np.random.default_rng(3).uniform(-1.0, 1.0, 60), np.zeros(20)])
    strike(engine, 4.0)
    take(engine, 8)
    pushes(engine, sounds)
    held, _ = never_more_than_given(engine, sounds)
    assert held > 0.0


def test_without_losses_it_keeps_all_of_that_work() -> None:
    cavity = CavityTable(depth_m=0.1, f01_Hz=700.0, t60_s=float("inf"))
    engine = engine_of(drum_of({"cavity": cavity, "sympathy": SympathyTable(200.0, 0.0)}))
    assert is_there(engine.effects.cavity)
    sounds = np.sin(0.3 * np.arange(400.0))
    pushes(engine, sounds)
    given = 0.0
    for pressure in sounds:
        level = int(engine.control["present_level"][0])
        before = engine.effects.cavity.head.time_levels[1 - level].copy()
        take(engine, 1)
        given += work_of(engine, pressure, before, engine.effects.cavity.head.time_levels[1 - level])
    assert energy(engine) == pytest.approx(given, rel=1e-4)


def test_it_wakes_for_a_neighbour_and_falls_asleep_again() -> None:
    outside = np.zeros(1024, np.float32)
    engine = hearing(build(snare(SympathyTable(20.0, 1.0)), RATE, StrikeRing()), outside)
    assert hears_others(engine)
    out = np.zeros((128, 2), np.float32)
    render_all(engine, out, 128, 0)
    assert int(engine.control["asleep"][0]) == 1
    outside[3] = 1.0
    render_all(engine, out, 128, 0)
    outside[:] = 0.0
    for _ in range(3):  # it is on its way for three milliseconds
        render_all(engine, out, 128, 0)
    assert int(engine.control["asleep"][0]) == 0
    assert engine.effects.cavity.head.time_levels.any()
    for _ in range(3 * RATE // 128):
        render_all(engine, out, 128, 0)
    assert int(engine.control["asleep"][0]) == 1
    assert not engine.effects.cavity.head.time_levels.any()


def test_longer_blocks_than_it_hears_hear_what_there_is() -> None:
    engine = build(snare(SympathyTable(20.0, 0.0)), RATE, StrikeRing())
    engine.effects.sympathy.outside[:] = 1.0
    render_all(engine, np.zeros((2000, 2), np.float32), 2000, 0)
    line = engine.effects.sympathy.line
    assert line[0] == 0.5  # half of its frames came before the block
    assert (line[1:512] == 1.0).all()
    assert line[512] == 0.5
    assert not line[513:].any()
