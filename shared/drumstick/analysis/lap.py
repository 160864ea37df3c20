"""One lap of the exact motion: from one release of the stick to the next.

A lap starts from a state of five numbers, float64 of shape (5,): the speed v_out at z = 0 going up (m/s), what
`pulse` and `cor_pulse` still have to give (m/s), and how long ago each of them fired (s). v_E, the speed once the
pulses have given the rest, is the sum of the first three. An effect that the scene does not name leaves its numbers 0.

Kernels: any thread; no allocation.
"""

import math

import numpy as np
import numpy.typing as npt

from drumstick import composition, exact
from realtime.jit import Record, Records, njit, only_with

Numbers = npt.NDArray[np.float64]

STATE_SIZE = 5
V_OUT, PULSE, COR_PULSE, PULSE_AGE, COR_PULSE_AGE = 0, 1, 2, 3, 4

# What `next_release` tells of the contact that it ends and the flight before it.
TOLD_SIZE = 6
V_IN, V_E, CONTACT_S, APEX_M, PERIOD_S, FLIGHT_S = 0, 1, 2, 3, 4, 5

# Beside exact.MOVING, CAPTURED and LEFT: nothing happened for so long that the search was given up. Only a pulse
# that holds a stick in the head for some ten thousand of its oscillations comes here.
UNDECIDED = 3

PATIENCE = 12  # the longest wait for an event is 2^PATIENCE times the first one
_FIRST_WAIT_RAD = 60.0
_LONGEST_WAIT_S = 1e9
_LONGEST_SAMPLED_WAIT_S = 10.0
_MOST_EVENTS = 20_000
_STIFFEST = 4.0  # how much an effect may raise K_coll


@only_with("pulse")
def _set_pulse(law: Record, motion: Record, left: float, age: float) -> None:
    motion.pulse.push = left / law.pulse.tau
    motion.pulse.age = age


@only_with("cor_pulse")
def _set_cor_pulse(law: Record, motion: Record, left: float, age: float) -> None:
    motion.cor_pulse.push = left / law.cor_pulse.tau
    motion.cor_pulse.age = age


@only_with("pulse")
def _read_pulse(law: Record, motion: Record, state: Numbers) -> None:
    state[PULSE] = motion.pulse.push * law.pulse.tau
    state[PULSE_AGE] = motion.pulse.age


@only_with("cor_pulse")
def _read_cor_pulse(law: Record, motion: Record, state: Numbers) -> None:
    state[COR_PULSE] = motion.cor_pulse.push * law.cor_pulse.tau
    state[COR_PULSE_AGE] = motion.cor_pulse.age


@only_with("hysteretic_spring", otherwise=False)
def _stiffens(law: Record) -> bool:
    return True


@only_with("negative_damping", otherwise=False)
def _loses_damping(law: Record) -> bool:
    return True


@only_with("system_delay", otherwise=False)
def _delayed(law: Record) -> bool:
    return True


@only_with("noise", otherwise=False)
def _noisy(law: Record) -> bool:
    return True


@njit()
def _oscillation(law: Record, above: bool) -> float:
    # Angular frequency of the motion here, 1/s, or an upper bound; 0 when overdamped. It sets the cost of a wait.
    if above:
        a = 0.5 * law.r_out / law.m
        return math.sqrt(max(law.k_hand / law.m - a * a, 0.0))
    if _stiffens(law) or _loses_damping(law):
        return math.sqrt((law.k_hand + _STIFFEST * law.k_coll) / law.m)
    a = 0.5 * law.r_in / law.m
    return math.sqrt(max((law.k_hand + law.k_coll) / law.m - a * a, 0.0))


@njit()
def first_wait(law: Record, motion: Record) -> float:
    """For how long, s, to look for the next event at first: about ten oscillations of where the stick is."""
    w = _oscillation(law, motion.place == exact.ABOVE)
    longest = _LONGEST_SAMPLED_WAIT_S if _delayed(law) or _noisy(law) else _LONGEST_WAIT_S
    return _FIRST_WAIT_RAD / w if w * longest > _FIRST_WAIT_RAD else longest


@njit()
def until(law: Record, motion: Record, wanted: int, patience: int) -> tuple[int, float]:
    """Move on to the next `wanted` event; returns how that ended and the seconds moved.

    exact.MOVING: it came; exact.CAPTURED, exact.LEFT: it never will; UNDECIDED: no event within reach.
    """
    moved = 0.0
    waited = 0
    for _ in range(_MOST_EVENTS):
        event, duration = exact.advance(law, motion, first_wait(law, motion) * 2.0**waited)
        moved += duration
        if event == wanted and motion.fate != exact.CAPTURED:
            return exact.MOVING, moved
        if motion.fate != exact.MOVING:
            return motion.fate, moved
        waited = waited + 1 if event == exact.HORIZON else 0
        if waited > patience or moved > _LONGEST_WAIT_S:
            break
    return UNDECIDED, moved


@njit()
def next_release(law: Record, motion: Record, patience: int, told: Numbers) -> int:
    """From above the head through one contact; returns how that ended, as `until`. told: shape (6,), filled."""
    fate, flight = until(law, motion, exact.ENTRY, patience)
    if fate != exact.MOVING:
        return fate
    told[APEX_M] = motion.z_apex
    fate, contact = until(law, motion, exact.RELEASE, patience)
    if fate != exact.MOVING:
        return fate
    told[V_IN] = motion.v_in
    told[V_E] = motion.v_out + composition.left(law, motion)
    told[CONTACT_S] = motion.contact_s
    told[FLIGHT_S] = flight
    told[PERIOD_S] = flight + contact
    return exact.MOVING


@njit()
def place(law: Record, fresh: Records, motion: Records, state: Numbers) -> None:
    """Put the stick into `state`, at z = 0 going up. fresh, motion: shape (1,), `fresh` a stick at rest, untouched."""
    motion[0] = fresh[0]
    motion[0].v = state[V_OUT]
    _set_pulse(law, motion[0], state[PULSE], state[PULSE_AGE])
    _set_cor_pulse(law, motion[0], state[COR_PULSE], state[COR_PULSE_AGE])


@njit()
def read(law: Record, motion: Record, state: Numbers) -> None:
    """The state just after a release."""
    state[V_OUT] = motion.v_out
    _read_pulse(law, motion, state)
    _read_cor_pulse(law, motion, state)


@njit()
def laps(
    law: Record, fresh: Records, motion: Records, state: Numbers, count: int, patience: int, told: Numbers
) -> int:
    """Carry `state` through `count` laps, in place; told: shape (count, 6). Returns how it ended, as `until`."""
    place(law, fresh, motion, state)
    for i in range(count):
        fate = next_release(law, motion[0], patience, told[i])
        if fate != exact.MOVING:
            return fate
        read(law, motion[0], state)
    return exact.MOVING
