"""Cost and pitch error of a drum, for `drumstick scene cost` and the benchmark.

Any thread; blocks while it computes.
"""

import time
from typing import NamedTuple

import numpy as np

from drumstick.drum.block import render_all
from drumstick.drum.build import size_of
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene

_BLOCK = 128
PITCH_HEARD_S = 8.0  # of sound, from which the pitch is measured


class RingingCost(NamedTuple):
    """CPU seconds of this thread for a ringing drum, and what was computed in them."""

    cpu_s: float
    junctions: int
    steps: int


def ringing(scene: Scene, rate_Hz: int, frames: int) -> RingingCost:
    """Render `frames` of the scene's drum while it rings, after as many that are not counted."""
    ring = StrikeRing()
    engine = build(scene, rate_Hz, ring)
    blow = strike_for_speed(scene, 1.0, 0.5, 0.0)
    ring.push_blow(blow)
    out = np.zeros((frames, 2), np.float32)
    render_all(engine, out, _BLOCK, 0)
    begun, steps = time.thread_time(), int(engine.control["steps"][0])
    render_all(engine, out, _BLOCK, 0)
    spent = time.thread_time() - begun
    return RingingCost(spent, size_of(engine), int(engine.control["steps"][0]) - steps)


def f01_error_cents(scene: Scene, rate_Hz: int) -> float:
    """Pitch error of the lowest mode in eight seconds of ringing, by the phase between two windows of the audio.

    The drum's t60_s should be some seconds, or nothing is left to measure.
    """
    f01 = scene.drum.f01_Hz
    sound = render(scene, [strike_for_speed(scene, 1.0, 0.0, 0.0)], PITCH_HEARD_S, rate_Hz)[:, 0].astype(
        float
    )
    length = 3 * rate_Hz
    t = np.arange(length) / rate_Hz
    carrier = np.exp(-2j * np.pi * f01 * t) * np.hanning(length)
    first, second = (np.sum(sound[s : s + length] * carrier) for s in (rate_Hz, 4 * rate_Hz))
    turned = float(np.angle(second * np.exp(-2j * np.pi * f01 * 3.0) / first))
    return float(1200.0 * np.log2(1.0 + turned / (2.0 * np.pi * 3.0) / f01))
