"""What is no longer heard costs no more than what is: tails in denormal numbers, and silence."""

import time

import numpy as np
import pytest

from drumstick.drum import Drum, Modal
from drumstick.drum_effects import Cavity, InternalLoss, Tension
from drumstick.scene import Scene
from sound_server.calibrate import build, full_scale
from sound_server.engine import Engine
from sound_server.events import StrikeRing
from sound_server.render import render_all

RATE = 48_000
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


def test_a_drum_at_rest_costs_next_to_nothing_for_an_hour() -> None:
    """Virtual time; it stays exactly silent, and a stroke after it sounds as the first one did."""
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
