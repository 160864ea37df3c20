"""The force of a blow, from one strike message: excitation `analytic`.

The message tells the peak force and the duration of the contact. The isolated blow of drumstick.contact is
z = -(v/w_d) e^(-a t) sin(w_d t), whose force is a half-sine bent by the damping; peak and duration alone do not fix
the bend, so the force here is the half-sine F(t) = F_peak sin(pi t / t_c), 0 <= t <= t_c. Over a step of the mesh its
mean is taken in closed form, so the impulse is exact however short the contact, and the onset may fall between steps.

The pool of active pulses has a fixed size; when it is full, a new pulse takes the place of the oldest.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from realtime.jit import Record, Records, njit

POOL = 32

# `age` is the time since the onset in mesh steps (negative: still to come); a pulse with age >= duration is over.
PULSE: np.dtype[Any] = np.dtype(
    [("junction", "i8"), ("age", "f8"), ("duration", "f8"), ("peak", "f8")], align=True
)
_ROW_HEIGHT = math.sqrt(3.0) / 2.0


@njit()
def mean_force(pulse: Record) -> float:
    """Mean of the half-sine over the step that begins at the pulse's age."""
    scale = math.pi / pulse.duration
    start = min(max(pulse.age, 0.0), pulse.duration)
    end = min(max(pulse.age + 1.0, 0.0), pulse.duration)
    return pulse.peak / scale * (math.cos(scale * start) - math.cos(scale * end))


@njit()
def begin(pulses: Records, begun: int, junction: int, age: float, duration: float, peak: float) -> int:
    """Start a pulse in the pool; returns the new count of pulses ever begun. Audio thread; no allocation."""
    pulse: Record = pulses[begun % pulses.shape[0]]
    pulse.junction = junction
    pulse.age = age
    pulse.duration = max(duration, 1e-3)  # of a step: shorter is an impulse all the same
    pulse.peak = peak
    return begun + 1


@njit()
def press(
    pulses: Records, plane: npt.NDArray[np.float32], weights: npt.NDArray[np.float32], gain: float
) -> int:
    """Add one step's force of every active pulse to `plane`; returns how many are active. Audio thread.

    The force counts as one more neighbour of its junction: a junction at the rim has a smaller weight and a smaller
    mass in proportion, and one outside the head takes no force at all.
    """
    active = 0
    for i in range(pulses.shape[0]):
        pulse: Record = pulses[i]
        if pulse.age < pulse.duration:
            active += 1
            junction = pulse.junction
            plane[junction] += np.float32(weights[junction] * gain * mean_force(pulse))
            pulse.age += 1.0
    return active


@njit()
def nearest(x: float, y: float, spacing: float, centre_row: int, centre_column: int, stride: int) -> int:
    """Flat index of the junction nearest to (x, y), in radii; points beyond the rim are drawn in. No allocation."""
    distance = math.sqrt(x * x + y * y)
    limit = 1.0 - spacing  # from here the nearest junction, at most h/sqrt(3) away, is inside
    if distance > limit:
        x, y = x * limit / distance, y * limit / distance
    low = math.floor(y / (_ROW_HEIGHT * spacing))
    best, found = 1e300, 0
    for up in range(low, low + 2):
        shift = 0.5 * (up & 1)
        column = math.floor(x / spacing - shift + 0.5)
        dx = (column + shift) * spacing - x
        dy = up * _ROW_HEIGHT * spacing - y
        if dx * dx + dy * dy < best:
            best = dx * dx + dy * dy
            found = (centre_row + up) * stride + centre_column + column
    return found
