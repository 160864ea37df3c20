"""One blow, three ways: as the stick makes it, as a strike's message tells it, and as a servo streams it. Any thread.

The truth is a contact of the roll that has settled, hand and pulse included, by the exact solver: the head's impulse
on the stick up to any time of it. The message is what is announced of that contact when it begins.
"""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.build import new_engine
from drumstick.drum.engine import Control, Engine
from drumstick.drum.excitation import force_resampling
from drumstick.drum.excitation.analytic import begin, damp, mean_force
from drumstick.drum.excitation.offline import ContactFeeder, StreamedContact
from drumstick.drum.memory.pulses import PULSE, JunctionForce
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.contact_ahead import PredictedContact, contact_ahead
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import njit

SCENE = "roll"
_SETTLED = 60  # contacts until each is like the one before
_SAMPLE_S = 1e-6  # of the true impulse; between two, a straight line
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


class Contact(NamedTuple):
    """One exact contact: its announcement, its speed, and the head's impulse, N s, up to each time in s."""

    announced: PredictedContact
    speed_m_per_s: float
    t_s: Numbers
    impulse_N_s: Numbers


def contact_of(played: Scene, settled: int = _SETTLED) -> Contact:
    """A contact of the scene's exact stick, after so many others. Raises ValueError when it makes no more."""
    law, motion = law_of(played), thrown(played, played.hand.throw_m_per_s)
    stick, begun, what = motion[0], 0, exact.HORIZON
    while begun <= settled:
        what, _ = exact.advance(law[0], stick, 1.0)
        if what == exact.HORIZON or stick["outcome"] != exact.MOVING:
            raise ValueError(f"{played.name} makes {begun} contacts, not {settled + 1}")
        begun += what == exact.ENTRY
    announced, speed = contact_ahead(law[0], stick, motion.copy()), -float(stick["v_in"])
    t_s, impulses = [0.0], [0.0]
    while what != exact.RELEASE:
        what, gone_s = exact.advance(law[0], stick, _SAMPLE_S)
        t_s.append(t_s[-1] + gone_s)
        impulses.append(float(stick["impulse_N_s"]))
    return Contact(announced, speed, np.array(t_s), np.array(impulses))


@functools.cache
def roll() -> Contact:
    """The contact that all three ways are of."""
    return contact_of(scene(False))


def strike(at_s: float) -> OfflineStrike:
    """Strike message of the contact: peak, duration and impulse."""
    ahead = roll().announced
    return OfflineStrike(at_s, *PLACE, ahead.peak_N, ahead.contact_s, ahead.impulse_N_s)


def true_impulse() -> Impulse:
    """Impulse by the exact solver."""
    contact = roll()
    return lambda t_s: np.interp(t_s, contact.t_s, contact.impulse_N_s)


def message_forces(blow: OfflineStrike, engine: Engine, steps: int, is_damped: bool = True) -> Numbers:
    """Mean force in each of an engine's first steps, N, by a strike's message: damped by its contact, or a half-sine."""
    step_s = float(engine.control["divisor"][0] / engine.control["rate_Hz"][0])
    pulses: Any = np.zeros(1, PULSE)
    begin(pulses, 0, 0.0, 0.0, -blow.t_s / step_s, blow.contact_s / step_s, blow.peak_N)
    if is_damped:
        damp(pulses[0], engine.contact[0], blow.impulse_N_s / step_s)
    found = np.zeros(steps)
    for i in range(steps):
        found[i] = mean_force(pulses[0])
        pulses["age"] += 1.0
    return found


def press_of(impulse: Impulse, at_s: float, rate_Hz: float) -> StreamedContact:
    """A contact that begins at at_s as a servo would tell it: means over its ticks, closed by 0 N."""
    first = math.floor(at_s * rate_Hz)
    count = math.ceil(strike(0.0).contact_s * rate_Hz) + 2
    ends_s = (first + np.arange(count + 1)) / rate_Hz - at_s
    forces = np.append(np.diff(impulse(ends_s)) * rate_Hz, 0.0)
    return StreamedContact(first, rate_Hz, *PLACE, forces)


@njit()
def pressed(engine: Engine, start_ns: int, out: Numbers) -> None:
    """The mean force, N, that a stream brings in each of the next len(out) steps of the mesh."""
    lent = borrowed_view(engine)
    control: Control = lent.control[0]
    force_resampling.take(lent, start_ns, out.shape[0] * control.divisor)
    for i in range(out.shape[0]):
        control.forces = 0
        force_resampling.apply_streamed_force(lent)
        out[i] = 0.0
        for k in range(control.forces):
            entry: JunctionForce = lent.forces[k]
            out[i] += entry.step / (lent.head.weights[entry.junction] * control.force_gain)


class Forces(NamedTuple):
    """Mean force over each step of the mesh, N: the truth, the message's, and what a stream makes of the truth."""

    true: Numbers
    message: Numbers
    streamed: Numbers


def forces_at(place: float, rate_Hz: float) -> Forces:
    """place: where between two ticks of a servo of rate_Hz the contact begins, 0..1."""
    engine = new_engine(scene(True), 48_000, StrikeRing())
    control: Control = engine.control[0]
    step_s = float(control["divisor"] / control["rate_Hz"])
    at_s = (math.floor(_LEAD_S * rate_Hz) + place) / rate_Hz
    true = true_impulse()
    feeder = ContactFeeder(engine, [press_of(true, at_s, rate_Hz)], 0)
    steps = _BLOCK_STEPS * math.ceil(_SPAN_S / step_s / _BLOCK_STEPS)
    ends_s = np.arange(steps + 1, dtype=np.float64) * step_s - at_s
    found = np.zeros(steps)
    for first in range(0, steps, _BLOCK_STEPS):
        feeder.give((first + _BLOCK_STEPS) * step_s)
        part: Any = found[first : first + _BLOCK_STEPS]
        pressed(engine, round(first * step_s * 1e9), part)
    return Forces(np.diff(true(ends_s)) / step_s, message_forces(strike(at_s), engine, steps), found)
