"""What is no longer heard costs no more than what is: tails in denormal numbers, and silence."""

import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.engine import Engine
from drumstick.drum.excitation.strikes import StrikeRing
from drumstick.parameters.drum import Drum, Modal
from drumstick.parameters.drum_effects import Cavity, InternalLoss, Tension
from drumstick.parameters.scene import Scene
from quiet import least_seconds
from realtime.jit import njit
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


class Tail:
    """One drum, as loud or as faint as is asked, in the same memory: where planes lie changes the cost by 7 %."""

    def __init__(self, scene: Scene) -> None:
        self.engine = engine = ringing(scene)
        self._planes = [engine.head.planes] if engine.modal is None else [engine.modal.q, engine.modal.d]
        self._planes += [engine.internal_loss.moving] if engine.internal_loss is not None else []
        self._planes += [engine.cavity.head.planes] if engine.cavity is not None else []
        self._planes.append(engine.history)
        self._kept = [plane.copy() for plane in self._planes]
        self._control = engine.control.copy()

    def seconds(self, share: float, play: Callable[[Engine], object]) -> float:
        """CPU time to play on, from `share` of the stroke: faint is as if it had rung very long, never louder."""
        for plane, kept in zip(self._planes, self._kept, strict=True):
            np.multiply(kept, np.float32(share), out=plane)
        self.engine.control[:] = self._control
        self.engine.control["loudest"] *= share
        begun = time.thread_time()
        play(self.engine)
        return time.thread_time() - begun


@shows("tail of denormal numbers", "ours")
@pytest.mark.parametrize("name", DRUMS)
def test_a_tail_of_denormal_numbers_costs_what_a_stroke_does(name: str) -> None:
    tail, out = Tail(DRUMS[name]), np.zeros((480, 2), np.float32)

    def play(engine: Engine) -> None:
        render_all(engine, out, 128, 0)
        assert engine.control["asleep"][0] == 0

    windows = [lambda share=share: tail.seconds(share, play) for share in (1.0, 1e-36)]
    loud, faint = least_seconds(windows)
    assert faint < 1.1 * loud


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
    """In turn: a stroke, its tail at 1e-40, the same tail in the mode that every thread begins with."""
    tail = Tail(DRUMS["mesh"])
    windows = [
        lambda share=share, flushes=flushes: tail.seconds(
            share, lambda engine: take(engine, 40, flushes=flushes)
        )
        for share, flushes in ((1.0, True), (1e-40, True), (1e-40, False))
    ]
    loud, flushed, naive = least_seconds(windows)
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
