"""One blow, three ways: as the contact law has it, as a strike's half-sine, and as a servo tells it. Any thread.

The truth is the isolated blow of drumstick.contact, z = -(v/w_d) e^(-a t) sin(w_d t), until the head lets go: its
force is m z'', so the impulse up to t is m (z'(t) - z'(0)), and means over any time are exact.
"""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.law import law_of
from drumstick.scene import Scene, parse, shipped_text
from realtime.jit import Record, njit
from realtime.lent import lend
from sound_server.build import new_engine
from sound_server.calibrate import blow_at
from sound_server.engine import Engine
from sound_server.events import StrikeRing
from sound_server.render import Blow
from sound_server.stream import playing
from sound_server.stream.offline import Press, Score

SCENE = "roll"
SPEED_M_PER_S = 1.0
PLACE = (0.5, 0.0)
FINE_RATE_HZ = 192_000.0  # of the truth, as a stream
_BLOCK_STEPS = 8
_SPAN_S = 0.06  # in which the blow and its stream have passed
_LEAD_S = 0.02  # before the blow: a stream reaches two ticks ahead
Numbers = npt.NDArray[np.float64]
Impulse = Callable[[Numbers], Numbers]  # N s up to a time after the contact, s


@functools.cache
def scene(streamed: bool) -> Scene:
    """The shipped roll, excited by strikes or by the force itself."""
    found = parse(shipped_text(SCENE), SCENE)
    kind = "streamed" if streamed else "analytic"
    return dataclasses.replace(found, drum=dataclasses.replace(found.drum, excitation=kind))


@functools.cache
def strike(at_s: float) -> Blow:
    """What the strike's message says: its half-sine's peak and duration."""
    return blow_at(scene(False), SPEED_M_PER_S, *PLACE, at_s)


def true_impulse() -> Impulse:
    """By the scene's contact law."""
    law: Record = law_of(scene(False))[0]
    m, k, r = float(law["m"]), float(law["k_coll"]), float(law["r_in"])
    a = r / (2.0 * m)
    w = math.sqrt(k / m - a * a)
    lasts_s = strike(0.0).contact_s

    def impulse(t_s: Numbers) -> Numbers:
        t = np.clip(t_s, 0.0, lasts_s)
        speed = np.exp(-a * t) * (np.cos(w * t) - a / w * np.sin(w * t))
        return m * SPEED_M_PER_S * (1.0 - speed)

    return impulse


def half_sine_impulse() -> Impulse:
    """By the strike's message."""
    blow = strike(0.0)

    def impulse(t_s: Numbers) -> Numbers:
        turn = math.pi * np.clip(t_s / blow.contact_s, 0.0, 1.0)
        return blow.peak_N * blow.contact_s / math.pi * (1.0 - np.cos(turn))

    return impulse


def press_of(impulse: Impulse, at_s: float, rate_Hz: float) -> Press:
    """A contact that begins at at_s as a servo would tell it: means over its ticks, closed by 0 N."""
    first = math.floor(at_s * rate_Hz)
    count = math.ceil(strike(0.0).contact_s * rate_Hz) + 2
    ends_s = (first + np.arange(count + 1)) / rate_Hz - at_s
    forces = np.append(np.diff(impulse(ends_s)) * rate_Hz, 0.0)
    return Press(first, rate_Hz, *PLACE, forces)


@njit()
def pressed(engine: Engine, start_ns: int, out: Numbers) -> None:
    """The mean force, N, that a stream brings in each of the next len(out) steps of the mesh."""
    lent = lend(engine)
    control: Record = lent.control[0]
    playing.take(lent, start_ns, out.shape[0] * control.divisor)
    for i in range(out.shape[0]):
        control.forces = 0
        playing.press(lent)
        out[i] = 0.0
        for k in range(control.forces):
            entry: Record = lent.forces[k]
            out[i] += entry.step / (lent.head.weights[entry.junction] * control.force_gain)


class Forces(NamedTuple):
    """Mean force over each step of the mesh, N: the truth, the half-sine, and what a stream makes of the truth."""

    true: Numbers
    half_sine: Numbers
    streamed: Numbers


def forces_at(place: float, rate_Hz: float) -> Forces:
    """place: where between two ticks of a servo of rate_Hz the contact begins, 0..1."""
    engine = new_engine(scene(True), 48_000, StrikeRing())
    control: Record = engine.control[0]
    step_s = float(control["divisor"] / control["rate_Hz"])
    at_s = (math.floor(_LEAD_S * rate_Hz) + place) / rate_Hz
    true, half_sine = true_impulse(), half_sine_impulse()
    score = Score(engine, [press_of(true, at_s, rate_Hz)], 0)
    steps = _BLOCK_STEPS * math.ceil(_SPAN_S / step_s / _BLOCK_STEPS)
    ends_s = np.arange(steps + 1, dtype=np.float64) * step_s - at_s
    found = np.zeros(steps)
    for begin in range(0, steps, _BLOCK_STEPS):
        score.give((begin + _BLOCK_STEPS) * step_s)
        part: Any = found[begin : begin + _BLOCK_STEPS]
        pressed(engine, round(begin * step_s * 1e9), part)
    return Forces(np.diff(true(ends_s)) / step_s, np.diff(half_sine(ends_s)) / step_s, found)
