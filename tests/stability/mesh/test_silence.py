"""Silence costs no more than sound: tails in denormal numbers, and nothing at all."""

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.drum import Drum, Modal
from drumstick.parameters.scene import Scene
from realtime.records import is_there
from stability.catalogue import shows
from stability.mesh_steps import take

RATE = 48_000
Floats = npt.NDArray[np.float32]
DRUMS = {
    "mesh": Scene("mesh", drum=Drum(t60_s=60.0)),
    "effects": Scene(
        "effects",
        drum=Drum(
            t60_s=60.0,
            effects={
                "internal_loss": InternalLossTable(),
                "tension": TensionTable(),
                "cavity": CavityTable(),
            },
        ),
    ),
    "modes": Scene("modes", drum=Drum(t60_s=60.0), modal=Modal(top_Hz=3000.0)),
}


def ringing(scene: Scene) -> Engine:
    ring = StrikeRing()
    engine = build(scene, RATE, ring)
    blow = full_scale(scene)
    ring.push(0, 0.4, 0.2, blow.peak_N, blow.contact_s)
    render_all(engine, np.zeros((RATE // 10, 2), np.float32), 128, 0)
    return engine


def arrays_of(engine: Engine) -> list[Floats]:
    """All that rings in it."""
    arrays = [engine.head.time_levels] if engine.modal is None else [engine.modal.q, engine.modal.d]
    arrays += [engine.effects.internal_loss.moving] if is_there(engine.effects.internal_loss) else []
    arrays += [engine.effects.cavity.head.time_levels] if is_there(engine.effects.cavity) else []
    return [*arrays, engine.history]


def made_faint(engine: Engine, share: float) -> None:
    """As if it had rung for very long."""
    for array in arrays_of(engine):
        np.multiply(array, np.float32(share), out=array)
    engine.control["loudest"] *= share


def denormal_numbers(engine: Engine) -> int:
    """Number of its values that are not 0 and below the least normal one; each can cost a hundred operations."""
    least = np.finfo(np.float32).tiny
    return sum(int(np.count_nonzero((array != 0.0) & (np.abs(array) < least))) for array in arrays_of(engine))


@shows("tail of denormal numbers", "ours")
@pytest.mark.parametrize("name", DRUMS)
@pytest.mark.parametrize("share", [1e-36, 1e-40])
def test_a_tail_has_no_denormal_numbers(name: str, share: float) -> None:
    engine = ringing(DRUMS[name])
    made_faint(engine, share)
    render_all(engine, np.zeros((480, 2), np.float32), 128, 0)
    assert engine.control["asleep"][0] == 0
    assert denormal_numbers(engine) == 0


@shows("tail of denormal numbers")
def test_without_the_float_mode_a_tail_is_made_of_denormal_numbers() -> None:
    """The same steps, in the mode that every thread begins with and in that of the audio thread."""
    left: dict[bool, int] = {}
    for flushes in (False, True):
        engine = ringing(DRUMS["mesh"])
        made_faint(engine, 1e-40)
        engine.history[:] = 0.0  # of the interpolator, which takes no part here
        take(engine, 40, flushes=flushes)
        left[flushes] = denormal_numbers(engine)
    assert left[True] == 0
    assert left[False] > 1000


@shows("hour of silence")
def test_a_drum_at_rest_costs_next_to_nothing_for_an_hour() -> None:
    """Virtual time; it stays exactly silent, and a stroke after it sounds as the first one did.

    A head that never sleeps takes every step of it.
    """
    scene = Scene("drum", drum=Drum(t60_s=0.05))
    ring = StrikeRing()
    engine = build(scene, RATE, ring)
    blow = full_scale(scene)
    strokes: list[np.ndarray] = []
    out = np.zeros((RATE, 2), np.float32)
    for hour in range(2):
        ring.push(0, 0.4, 0.2, blow.peak_N, blow.contact_s)
        render_all(engine, out, 128, hour * 3_600_000_000_000)
        strokes.append(out.copy())
        steps = int(engine.control["steps"][0])
        for minute in range(60 if hour == 0 else 0):
            for _ in range(60):
                render_all(engine, out, 4096, minute * 60_000_000_000)
            assert not out.any()
        assert int(engine.control["steps"][0]) - steps < 8192
    assert np.array_equal(strokes[0][: RATE // 2], strokes[1][: RATE // 2])
    naive_steps = -int(engine.control["steps"][0])
    for _ in range(10):
        engine.control["asleep"] = 0
        render_all(engine, out[: RATE // 10], 4096, 0)
    naive_steps += int(engine.control["steps"][0])
    assert naive_steps * 3600 > 1000 * 8192
