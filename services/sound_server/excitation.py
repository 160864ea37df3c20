"""The force of a blow, from one strike message: excitation `analytic`.

The message tells the peak force and the duration of the contact. The isolated blow of drumstick.contact is
z = -(v/w_d) e^(-a t) sin(w_d t), whose force is a half-sine bent by the damping; peak and duration alone do not fix
the bend, so the force here is the half-sine F(t) = F_peak sin(pi t / t_c), 0 <= t <= t_c. Over a step of the mesh its
mean is taken in closed form, so the impulse is exact however short the contact, and the onset may fall between steps.

The pool of active pulses has a fixed size; when it is full, a new pulse takes the place of the oldest. Kernels: audio
thread; no allocation.
"""

import math
from typing import Any

import numpy as np

from realtime.jit import Record, Records, njit
from sound_server.effects import rim
from sound_server.membrane.places import CORNERS
from sound_server.modal import bank
from sound_server.push import push
from sound_server.stream import playing

POOL = 32

# `age` is the time since the onset in mesh steps (negative: still to come); a pulse with age >= duration is over.
PULSE: np.dtype[Any] = np.dtype(
    [("x", "f8"), ("y", "f8"), ("age", "f8"), ("duration", "f8"), ("peak", "f8")], align=True
)
FORCES = (POOL + 1) * CORNERS  # each pulse, and a streamed force


@njit()
def mean_force(pulse: Record) -> float:
    """Mean of the half-sine over the step that begins at the pulse's age."""
    scale = math.pi / pulse.duration
    start = min(max(pulse.age, 0.0), pulse.duration)
    end = min(max(pulse.age + 1.0, 0.0), pulse.duration)
    return pulse.peak / scale * (math.cos(scale * start) - math.cos(scale * end))


@njit()
def begin(pulses: Records, begun: int, x: float, y: float, age: float, duration: float, peak: float) -> int:
    """Start a pulse in the pool; returns the new count of pulses ever begun."""
    pulse: Record = pulses[begun % pulses.shape[0]]
    pulse.x = x
    pulse.y = y
    pulse.age = age
    pulse.duration = max(duration, 1e-3)  # of a step: shorter is an impulse all the same
    pulse.peak = peak
    return begun + 1


@njit()
def press(engine: Record) -> int:
    """Let this step's forces act: listed in engine.forces for the mesh, on the modes of a bank at once.

    Returns how many pulses are active, a streamed force included.
    """
    control, pulses = engine.control[0], engine.pulses
    control.forces = 0
    rim.begin(engine)
    if control.active == 0 and control.looked == control.begun:
        return int(playing.press(engine))  # the pool is empty, as it mostly is
    active = 0
    for i in range(pulses.shape[0]):
        pulse: Record = pulses[i]
        if pulse.age < pulse.duration:
            active += 1
            if -1.0 < pulse.age <= 0.0:
                rim.strike(engine, pulse.x, pulse.y, pulse.peak * pulse.duration * 2.0 / math.pi)
            force = mean_force(pulse)
            pulse.age += 1.0
            if force == 0.0:
                continue
            push(engine, pulse.x, pulse.y, force)
            bank.push(engine, i, force)
    control.active, control.looked = active, control.begun
    return active + int(playing.press(engine))
