"""The force of a blow, from one strike message: excitation `analytic`.

The isolated blow of drumstick.stick.contact is z = -(v/w_d) e^(-a t) sin(w_d t); the head's force on it is

    F(t) = C e^(-a t) sin(w_d t + phi),  tan phi = 2 b w_d / (w_d^2 + a^2 - 2 a b),

with a = R_in/2m, b = (R_in - R_out)/2m,

until z = 0, w_d t = pi (release "paper"), or until F = 0, w_d t = pi - phi ("unilateral"). The scene tells a and b, the
message the duration, which gives w_d also after a live change of the stiffness, and the impulse, which gives C. So the
impulse is that of the contact that was foreseen, with its pulses and effects; how these bend the force is left out. An
older message tells no impulse: its force is the half-sine of its peak, a = b = 0. Means over a step of the mesh are in
closed form: the impulse is exact however short the contact, and the onset may fall between steps.

The pool of active pulses has a fixed size; when it is full, a new pulse takes the place of the oldest. Kernels: audio
thread; no allocation.
"""

import math
from typing import TYPE_CHECKING

from drumstick.drum.effects import composition
from drumstick.drum.excitation import force_resampling
from drumstick.drum.excitation.point_force import push
from drumstick.drum.memory.pulses import ContactDecay, ContactPulse
from drumstick.drum.modal import bank, blocks
from realtime.kernels.jit import njit, only_with
from realtime.records import Records

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine


_MAX_DECAY = 1.0  # a damping ratio of 0.7: beyond it there is hardly a rebound
_ROUNDS = 12  # for w_d of a given duration, to 1e-6


@njit()
def _rest(pulse: ContactPulse, angle: float) -> float:
    # Integral from this angle to infinity of e^(-decay p) sin(p + phase), for decay > 0; any, for differences.
    at, decay = angle + pulse.phase, pulse.decay
    return math.exp(-decay * angle) * (decay * math.sin(at) + math.cos(at)) / (1.0 + decay * decay)


@njit()
def mean_force(pulse: ContactPulse) -> float:
    """Mean force over the step that begins at the pulse's age, N."""
    scale = pulse.turn / pulse.duration
    start = min(max(pulse.age, 0.0), pulse.duration)
    end = min(max(pulse.age + 1.0, 0.0), pulse.duration)
    return pulse.size / scale * (_rest(pulse, scale * start) - _rest(pulse, scale * end))


@njit()
def begin(pulses: Records, begun: int, x: float, y: float, age: float, duration: float, peak: float) -> int:
    """Start a half-sine in the pool; returns the new count of pulses ever begun."""
    pulse: ContactPulse = pulses[begun % pulses.shape[0]]
    pulse.x = x
    pulse.y = y
    pulse.age = age
    pulse.duration = max(duration, 1e-3)  # of a step: shorter is an impulse all the same
    pulse.turn, pulse.phase, pulse.decay = math.pi, 0.0, 0.0
    pulse.size = peak
    pulse.impulse = peak * pulse.duration * 2.0 / math.pi
    return begun + 1


@njit()
def damp(pulse: ContactPulse, contact: ContactDecay, impulse: float) -> None:
    """Make a pulse that has begun that of a damped contact, with this impulse, N steps.

    contact: its a and b per step, as `decay` and `own_decay`, and `pulls`, 1 for a head that pulls at the end.
    """
    for _ in range(_ROUNDS):
        pulse.turn = math.pi if contact.pulls != 0 else math.pi - pulse.phase
        step = pulse.duration / pulse.turn  # steps a radian
        pulse.decay = min(contact.decay * step, _MAX_DECAY)
        own = min(contact.own_decay * step, pulse.decay)
        pulse.phase = math.atan2(2.0 * own, 1.0 + pulse.decay * (pulse.decay - 2.0 * own))
    pulse.size = impulse * pulse.turn / pulse.duration / (_rest(pulse, 0.0) - _rest(pulse, pulse.turn))
    pulse.impulse = impulse


@only_with("blocks", otherwise=0)
def forces_ahead(engine: "Engine", steps: int) -> int:
    """Forces of so many coming steps into engine.blocks, of each pulse that acts in them; returns how many do."""
    pulses, ahead, count = engine.pulses, engine.blocks, 0
    for i in range(pulses.shape[0]):
        pulse: ContactPulse = pulses[i]
        age = pulse.age
        if age < pulse.duration and age + steps > 0.0:
            for n in range(steps):
                ahead.forces[count, n] = mean_force(pulse)
                pulse.age += 1.0
            pulse.age = age  # it has not acted yet
            ahead.rows[count] = i
            count += 1
    return count


@njit(inline=True)
def apply_forces(engine: "Engine") -> int:
    """Let this step's forces act: listed in engine.forces for the mesh, on the modes of a bank at once.

    Returns how many pulses are active, a streamed force included.
    """
    control, pulses = engine.control[0], engine.pulses
    control.forces = 0
    composition.begin_step(engine)
    if control.active == 0 and control.begun_at_last_scan == control.begun:
        return int(force_resampling.apply_streamed_force(engine))  # the pool is empty, as it mostly is
    active = 0
    for i in range(pulses.shape[0]):
        pulse: ContactPulse = pulses[i]
        if pulse.age < pulse.duration:
            active += 1
            if -1.0 < pulse.age <= 0.0:
                composition.struck(engine, pulse.x, pulse.y, pulse.impulse)
            if blocks.is_ahead(engine):  # and its force has driven the modes
                pulse.age += 1.0
                continue
            force = mean_force(pulse)
            pulse.age += 1.0
            if force == 0.0:
                continue
            push(engine, pulse.x, pulse.y, force)
            bank.push(engine, i, force)
    control.active, control.begun_at_last_scan = active, control.begun
    return active + int(force_resampling.apply_streamed_force(engine))
