"""What is no longer heard costs no more than what is: tails in denormal numbers, and silence."""

import time

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum import Drum, Modal
from drumstick.drum_effects import Cavity, InternalLoss, Tension
from drumstick.scene import Scene
from realtime.jit import njit
from sound_server.calibrate import build, full_scale
from sound_server.engine import Engine
from sound_server.events import StrikeRing
from sound_server.render import render_all
from stability.catalogue import shows
from stability.mesh_steps import take

RATE = 48_000
Floats = npt.NDArray[np.float32]
DRUMS = {
    "mesh": Scene("mesh", drum=Drum(t60_s=60.0)),
    "effects": Scene(
        "effects",
        drum=Drum(
            t60_s=60.0, effects={"internal_loss": InternalLoss(), "tension": Tension(), "cavity": Cavity()}
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


def fainter(engine: Engine, share: float) -> None:
    """As if it had rung for a very long time, and had never been louder."""
    planes = [engine.head.planes] if engine.modal is None else [engine.modal.q, engine.modal.d]
    planes += [engine.internal_loss.moving] if engine.internal_loss is not None else []
    planes += [engine.cavity.head.planes] if engine.cavity is not None else []
    for plane in planes:
        plane *= np.float32(share)
    engine.history[:] *= np.float32(share)
    engine.control["loudest"] *= share


@shows("tail of denormal numbers", "ours")
@pytest.mark.parametrize("name", DRUMS)
def test_a_tail_of_denormal_numbers_costs_what_a_stroke_does(name: str) -> None:
    loud, faint = ringing(DRUMS[name]), ringing(DRUMS[name])
    fainter(faint, 1e-36)
    out = np.zeros((480, 2), np.float32)
    least = [np.inf, np.inf]
    for _ in range(40):
        for k, engine in enumerate((loud, faint)):
            begun = time.thread_time()
            render_all(engine, out, 128, 0)
            least[k] = min(least[k], time.thread_time() - begun)
        assert faint.control["asleep"][0] == 0
    assert least[1] < 1.1 * least[0]


@njit()
def _decayed(numbers: Floats, times: int) -> None:
    for _ in range(times):
        for i in range(len(numbers)):
            numbers[i] *= np.float32(0.9999)


def _price_of_denormals() -> float:
    # What this processor itself takes for them, in multiplications alone: some take next to nothing.
    least = [np.inf, np.inf]
    _decayed(np.ones(4096, np.float32), 1)
    for _ in range(20):
        for k, size in enumerate((1.0, 1e-41)):
            numbers = np.full(4096, size, np.float32)
            begun = time.thread_time()
            _decayed(numbers, 20)
            least[k] = min(least[k], time.thread_time() - begun)
    return least[1] / least[0]


@shows("tail of denormal numbers")
def test_without_the_float_mode_the_same_tail_costs_many_times_as_much() -> None:
    """In turn: a stroke, its tail at 1e-36, the same tail in the mode that every thread begins with."""
    engines = [ringing(DRUMS["mesh"]) for _ in range(3)]
    for engine in engines[1:]:
        fainter(engine, 1e-40)
    least = [np.inf] * 3
    for _ in range(40):
        for k, engine in enumerate(engines):
            begun = time.thread_time()
            take(engine, 40, flushes=k < 2)
            least[k] = min(least[k], time.thread_time() - begun)
    loud, flushed, naive = least
    assert flushed < 1.1 * loud
    # A tenth of what a plain loop pays: 3 times where denormals cost 30 times, nothing where they cost nothing.
    assert naive > loud * (0.9 + 0.1 * (min(_price_of_denormals(), 31.0) - 1.0))


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
