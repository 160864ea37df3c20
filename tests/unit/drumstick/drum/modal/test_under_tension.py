"""Bounds that keep a bank of modes stable under tension, under strong losses, and without a baffle."""

import dataclasses
import math

import numpy as np
import pytest

from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.air_load import in_air
from drumstick.drum.modal.radiation import heard_by
from drumstick.parameters.drum import Drum, Listen, Modal
from drumstick.parameters.mallet import MATERIALS
from drumstick.parameters.scene import Scene
from mallets import start_mallet, with_mallet
from realtime.records import is_there
from stability.mesh_steps import RATE, take


def _scene(effects: dict[str, object], f01_Hz: float = 150.0, top_Hz: float = 6000.0) -> Scene:
    return Scene("bank", drum=Drum(f01_Hz=f01_Hz, t60_s=1.0, effects=effects), modal=Modal(top_Hz))


def _cycles_per_step(engine: Engine) -> np.ndarray:
    # Of each mode, a step: k = 1 - 2 R cos(theta) + R^2.
    assert engine.modal is not None
    r_squared = engine.modal.r_squared.astype(float)
    cosine = (1.0 + r_squared - engine.modal.stiffness) / (2.0 * np.sqrt(r_squared))
    return np.arccos(np.clip(cosine, -1.0, 1.0)) / (2.0 * math.pi)


@pytest.mark.parametrize(("f01_Hz", "top_Hz"), [(150.0, 8000.0), (2000.0, 200.0), (40.0, 1500.0)])
def test_modes_that_stretch_the_head_stay_below_a_quarter_of_a_cycle(f01_Hz: float, top_Hz: float) -> None:
    """Beyond it <u+, L u> has the sign of a phase; the lowest mode has twelve steps a cycle."""
    engine = new_engine(_scene({"tension": TensionTable(60.0)}, f01_Hz, top_Hz), RATE, StrikeRing())
    cycles = _cycles_per_step(engine)
    assert cycles.max() < 0.25
    assert cycles.min() <= 1.0 / 12.0 + 1e-6
    free = new_engine(_scene({}, f01_Hz, top_Hz), RATE, StrikeRing())
    assert cycles.max() <= _cycles_per_step(free).max() + 1e-6


@pytest.mark.parametrize("glide_cents", [60.0, 700.0, 1200.0])
def test_a_rising_tension_has_room_up_to_its_most(glide_cents: float) -> None:
    engine = new_engine(_scene({"tension": TensionTable(glide_cents)}, top_Hz=20_000.0), RATE, StrikeRing())
    assert is_there(engine.effects.tension)
    most = float(engine.effects.tension.state["q_most"][0])
    assert (2.0 - 2.0 * np.cos(2.0 * math.pi * _cycles_per_step(engine).max())) * (1.0 + most) < 4.0


def test_a_mode_that_is_gone_in_a_step_leaves_numbers() -> None:
    effects = {"tension": TensionTable(60.0), "internal_loss": InternalLossTable(0.001, 200.0)}
    engine = new_engine(_scene(effects), RATE, StrikeRing())
    assert engine.modal is not None
    for array in (engine.modal.radial, engine.modal.tension_stiffness, engine.modal.stretch_weights):
        assert array is not None
        assert np.isfinite(array).all()


@pytest.mark.parametrize("material", ["wood", "felt", "hand"])
def test_with_mallets_cents_count_from_the_end_of_their_own_touch(material: str) -> None:
    scene = _scene({"tension": TensionTable(80.0)}, top_Hz=3000.0)
    scene = with_mallet(scene, material=material, **MATERIALS[material])
    ring = StrikeRing()
    engine = build(scene, RATE, ring)
    assert engine.mallets is not None
    assert is_there(engine.effects.tension)
    state, mallet = engine.effects.tension.state, engine.mallets.pool
    blow = full_scale(scene)
    engine.control["asleep"] = 0
    start_mallet(engine, blow.speed_m_per_s, 0.5, 0.0)
    touched = False
    for _ in range(round(0.05 * RATE)):
        take(engine, 1)
        pushes = bool(mallet["force"][0] > 0.0)
        if touched and not pushes:
            break
        touched = touched or pushes
    step_s = float(engine.control["divisor"][0]) / RATE
    pulls: list[float] = []
    for _ in range(round(1.0 / 150.0 / step_s)):
        take(engine, 1)
        pulls.append(float(state["pull"][0]))
    assert 600.0 * math.log2(1.0 + np.mean(pulls)) == pytest.approx(80.0, rel=0.15)


def test_without_a_baffle_low_modes_radiate_less_and_ring_longer() -> None:
    drums = [
        Drum(f01_Hz=120.0, radius_m=0.165, effects={"air": AirTable(1.2, 0.26, baffle)})
        for baffle in ("endless", "none")
    ]
    within, without = (in_air(40.0, drum) for drum in drums)
    k = 2.0 * math.pi * within.f_Hz * 0.165 / 343.2
    share = k**2 / (1.0 + k**2)
    assert without.f_Hz == pytest.approx(within.f_Hz)
    assert without.decays == pytest.approx(share * within.decays)
    assert share[0] < 0.2
    listen = Listen(microphones=((0.5, 0.3, 0.6, 0.0),))
    (loud, _), (soft, _) = (
        heard_by(dataclasses.replace(Scene("bank"), drum=drum, listen=listen), 40.0)[0] for drum in drums
    )
    assert np.abs(soft) == pytest.approx(np.sqrt(share) * np.abs(loud))
