"""Moves of a muffle on a bank of modes: when they come, and that none of its own makes energy."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine, set_live
from drumstick.drum.memory.bank import PRESS_STEPS
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal import bank, blocks, held, stretch
from drumstick.drum.modal.building import highest_zero
from drumstick.drum.modal.covered import covered_by
from drumstick.parameters.drum import Drum, Listen, Modal
from drumstick.parameters.scene import Scene
from mallets import in_bank, joules, start_mallet, with_mallet
from realtime.kernels.jit import njit
from realtime.records import is_there

RATE = 48_000
PATCHES = ((0.3, 0.5, 0.25), (0.45, 0.35, 0.3), (-0.8, -0.2, 0.2))
POLYESTER = TensionTable(young_GPa=5.2, thickness_mm=0.216, most_cents=1200.0)


def _scene(patch_t60_s: float, top_Hz: float, **effects: Any) -> Scene:
    muffle = MuffleTable(PATCHES, patch_t60_s, 0.0)
    drum = Drum(f01_Hz=150.0, radius_m=0.17, t60_s=math.inf, effects=effects | {"muffle": muffle})
    scene = with_mallet(Scene("bank", drum=drum, modal=Modal(top_Hz)))
    if effects:
        scene = dataclasses.replace(scene, listen=Listen(microphones=((-0.5, 0.6, 0.5, -0.6),)))
    return scene


def _engine(scene: Scene) -> Engine:
    return new_engine(scene, RATE, StrikeRing())


def _take(engine: Engine, steps: int) -> None:
    out = np.zeros((steps * int(engine.control["divisor"][0]), 2), np.float32)
    render_all(engine, out, len(out), 0)


def _press(engine: Engine) -> float:
    return float(engine.effects.muffle.state["press"][0])


def _is_touched(engine: Engine) -> bool:
    tips = engine.mallets.tips
    return bool((tips["depth"] > 0.0).any() or (tips["depth_before"] > 0.0).any())


def test_it_moves_at_each_of_its_steps_whether_a_tip_is_pressed_in_or_not_and_at_no_other() -> None:
    """Strokes of which some lie across the step at which it moves."""
    engine, moved, touched_too = _engine(_scene(0.05, 3000.0)), 0, 0
    target = 0.0
    for ahead in (10, 40, 150, 5, 20, 200):
        _take(engine, (-int(engine.control["steps"][0]) - ahead) % PRESS_STEPS)
        start_mallet(engine, 1.0)
        target = 1.0 - target
        set_live(engine, "muffle", target)
        for _ in range(2 * PRESS_STEPS):
            may = int(engine.control["steps"][0]) % PRESS_STEPS == 0 and _press(engine) != target
            touched, before = _is_touched(engine), _press(engine)
            _take(engine, 1)
            assert (_press(engine) != before) == may
            moved += may
            touched_too += may and touched
        assert _press(engine) == target
    assert touched_too >= 1
    assert moved >= 6


def test_a_tip_that_stays_in_touch_does_not_hold_the_hand_up() -> None:
    """A heavy and soft one, which lies on the head for more than a second: the hand comes all the same, and no step
    makes energy."""
    scene = with_mallet(_scene(0.05, 1500.0), mass_kg=1.0, stiffness_N_per_m_p=1e3, exponent=3.0)
    engine, most = _engine(scene), 0.0
    start_mallet(engine, 0.1)
    _take(engine, PRESS_STEPS - 20)
    assert _is_touched(engine)
    set_live(engine, "muffle", 1.0)
    before = joules(engine)
    for _ in range(2 * PRESS_STEPS):
        _take(engine, 1)
        now = joules(engine)
        most = max(most, now / before - 1.0)
        before = now
        assert _is_touched(engine)
    assert _press(engine) == 1.0
    assert most < 1e-6


@njit()
def _half_taken(engine: Engine) -> None:
    blocks.run(engine, 0, 20)
    for _ in range(10):
        blocks.handed_out(engine)


@njit()
def _follow(engine: Engine) -> bool:
    return bool(held.follow(engine))


def test_a_hand_that_comes_within_a_block_waits_for_its_end() -> None:
    """Set by another thread, at a step at which it may move, while the modes are steps ahead of what is heard."""
    scene = dataclasses.replace(_scene(0.05, 1500.0), mallet=None)
    engine = _engine(scene)
    free = engine.modal.r_squared.copy()
    _half_taken(engine)
    set_live(engine, "muffle", 1.0)
    assert not _follow(engine)
    assert _press(engine) == 0.0
    np.testing.assert_array_equal(engine.modal.r_squared, free)
    engine.blocks.state["taken"] = engine.blocks.state["steps"]
    assert _follow(engine)
    assert _press(engine) > 0.0
    assert (engine.modal.r_squared < free).any()


@njit()
def _look(engine: Engine) -> None:
    stretch.look(engine)


def _ringing(engine: Engine, rise: float, chance: np.random.Generator) -> None:
    # All modes at random, which together raise the tension by that share.
    modes, count = engine.modal, len(engine.modal.orders)
    moves = np.concatenate([np.ones(count, bool), modes.orders > 0, np.zeros(len(modes.q) - 2 * count, bool)])
    q = np.zeros(len(modes.q))
    q[moves] = chance.standard_normal(int(moves.sum())) / np.sqrt(modes.stretch_weights[moves])
    stretched = 0.5 * float(np.sum(modes.stretch_weights * q**2))
    q *= math.sqrt(rise / float(engine.effects.tension.state["kappa"][0]) / stretched)
    modes.q[:] = q
    modes.d[:] = chance.standard_normal(len(q)) * np.abs(q) * np.sqrt(modes.stiffness)
    engine.control["asleep"], engine.control["loudest"] = 0, float(np.abs(q).max())
    _look(engine)


@pytest.mark.parametrize("t60_s", [0.001, 0.02])
def test_letting_go_while_the_head_is_stretched_leaves_its_energy(t60_s: float) -> None:
    """The whole way in one step, without any loss. The pull of that step was foreseen with the modes held: by it the
    energy would rise by 0.2 to 3 %."""
    engine = _engine(_scene(t60_s, 1500.0, tension=POLYESTER, air=AirTable(0.0, 0.26, "none")))
    assert not is_there(engine.blocks)  # all modes are where the step has left them
    engine.effects.muffle.state["most"] = 1.0
    chance, pulls, changes = np.random.default_rng(3), list[float](), {0.0: list[float](), 1.0: list[float]()}
    for _ in range(8):
        _ringing(engine, 0.8, chance)
        target = 1.0 - _press(engine)
        set_live(engine, "muffle", target)
        before = in_bank(engine)
        _take(engine, 1)
        assert _press(engine) == target
        changes[target].append(in_bank(engine) / before - 1.0)
        pulls.append(float(engine.effects.tension.state["pull"][0]))
        _take(engine, PRESS_STEPS - 1)
    assert min(pulls) > 0.2
    assert np.abs(changes[0.0]).max() < 1e-6
    assert max(changes[1.0]) < -1e-3


@njit()
def _lay(engine: Engine, x: float, y: float) -> None:
    bank.compute_strike_weights(engine.modal, 0, x, y)


def _coefficients(engine: Engine) -> dict[str, np.ndarray]:
    # Of a step of each mode, d' = R^2 d - (k + r k g) q + b F, and what a tip sees of it.
    _lay(engine, -0.4, 0.6)
    modes, size = engine.modal, 2 * len(engine.modal.orders)
    of = {name: getattr(modes, name)[:size].astype(float) for name in ("r_squared", "stiffness", "masses")}
    weights = modes.strike_weights[0, :size].astype(float)
    pulled = of["r_squared"] * modes.tension_stiffness[:size]
    pushed, seen = of["r_squared"] * weights, of["masses"] * weights
    return {"kept": of["r_squared"], "k": of["stiffness"], "r k": pulled, "b": pushed, "seen": seen}


@pytest.mark.parametrize("t60_s", [0.005, 0.05])
def test_held_modes_step_by_the_equation_with_the_patches_loss_in_it(t60_s: float) -> None:
    """q+ - 2 q + q- = -K (1 + r g) q - (s + p s_m) (q+ - q-) + b F, with s_m of the patch's own decay times what of the
    mode lies under it. Neither K, r, b nor what a tip sees of the head has p in it."""
    scene = _scene(t60_s, 1500.0, tension=POLYESTER, air=AirTable(1.2, 0.26, "none"))
    engine, press = _engine(scene), 0.37
    engine.effects.muffle.state["most"] = 1.0
    free = _coefficients(engine)
    set_live(engine, "muffle", press)
    engine.control["asleep"] = 0
    _take(engine, 1)
    assert _press(engine) == press
    held = _coefficients(engine)
    step_s = float(engine.control["divisor"][0]) / RATE
    covered = covered_by(highest_zero(scene, 1.0 / step_s), scene.drum)
    assert covered is not None
    s = (1.0 - free["kept"]) / (1.0 + free["kept"])
    more = press * math.tanh(3.0 * math.log(10.0) / t60_s * step_s) * covered.shares
    assert more.max() > 1e-3
    np.testing.assert_allclose(held["kept"], (1.0 - s - more) / (1.0 + s + more), rtol=1e-5)
    for name in ("k", "r k", "b"):
        np.testing.assert_allclose(held[name], free[name] * (1.0 + s) / (1.0 + s + more), rtol=1e-5)
    np.testing.assert_allclose(held["seen"], free["seen"], rtol=1e-5)
