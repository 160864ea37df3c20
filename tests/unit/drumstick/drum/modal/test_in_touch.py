"""The step of a bank under tension that a mallet meets, against the same sums in loops of their own."""

import dataclasses

import numpy as np
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.mallets import shares
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal import stretch
from drumstick.parameters.drum import Drum, Listen, Modal
from drumstick.parameters.scene import Scene
from mallets import start_mallet, with_mallet
from realtime.kernels.jit import njit

RATE = 48_000
TENSION = TensionTable(young_GPa=5.2, thickness_mm=0.216, most_cents=1200.0)


def _engine() -> Engine:
    drum = Drum(
        f01_Hz=100.0,
        radius_m=0.2,
        t60_s=1.0,
        effects={"tension": TENSION, "internal_loss": InternalLossTable(0.5, 3000.0)},
    )
    scene = with_mallet(Scene("bank", drum=drum, modal=Modal(3000.0)))
    scene = dataclasses.replace(scene, listen=Listen(microphones=((-0.5, 0.6, 0.5, -0.6),)))
    return new_engine(scene, RATE, StrikeRing())


def _take(engine: Engine, steps: int) -> np.ndarray:
    out = np.zeros((steps * int(engine.control["divisor"][0]), 2), np.float32)
    render_all(engine, out, len(out), 0)
    return out


@njit()
def _newton(engine: Engine, slot: int) -> float:
    return stretch.of_newton(engine, slot)


@njit()
def _look(engine: Engine) -> None:
    stretch.look(engine)


def test_a_touched_step_tells_what_the_loops_of_their_own_tell() -> None:
    engine = _engine()
    start_mallet(engine, 10.0, 0.6, 0.2)
    state, tight = engine.mallets.state, engine.effects.tension.state
    told = 0
    for _ in range(200):
        _take(engine, 1)
        slot = int(state["foreseen"][0])
        if slot < 0 or state["begun"][0] == state["oldest"][0]:  # not yet, or gone
            continue
        told += 1
        assert state["height_ahead"][0] == pytest.approx(shares.ahead(engine, slot), rel=1e-4, abs=1e-9)
        assert state["newton_ahead"][0] == pytest.approx(_newton(engine, slot), rel=1e-4, abs=1e-9)
        sums = [float(tight[name][0]) for name in ("before", "x", "y")]
        _look(engine)
        for name, one in zip(("before", "x", "y"), sums, strict=True):
            assert one == pytest.approx(float(tight[name][0]), rel=1e-4, abs=1e-9 * abs(sums[0]) + 1e-15)
    assert told > 50


def test_a_mallet_beside_another_pushes_as_alone() -> None:
    """The newest is carried with the step; the first, beside it, pushes and looks by loops of its own."""
    alone, both = _engine(), _engine()
    for engine in (alone, both):
        start_mallet(engine, 10.0, 0.6, 0.2)
    start_mallet(both, 1e-6, -0.8, 0.0)  # it hardly moves
    for _ in range(100):
        for engine in (alone, both):
            _take(engine, 1)
        if alone.mallets.pool["force"][0] > 0.0:
            assert both.mallets.pool["force"][0] == pytest.approx(alone.mallets.pool["force"][0], rel=1e-3)
    assert np.abs(alone.modal.q - both.modal.q).max() < 1e-3 * np.abs(alone.modal.q).max()
