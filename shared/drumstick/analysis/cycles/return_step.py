"""One return of the exact motion: from one release of the stick to the next.

A return starts from a state of five numbers, float64 of shape (5,): the speed v_out at z = 0 going up (m/s), what
`pulse` and `cor_pulse` still have to give (m/s), and how long ago each of them fired (s). v_E, the speed once the
pulses have given the rest, is the sum of the first three. An effect that the scene does not name leaves its numbers 0.

Kernels: any thread; no allocation.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick import composition
from drumstick.stick.effects import decaying_pulse
from drumstick.stick.law import thrown
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit, only_with
from realtime.records import Records

Numbers = npt.NDArray[np.float64]

STATE_SIZE = 5
V_OUT, PULSE, COR_PULSE, PULSE_AGE, COR_PULSE_AGE = 0, 1, 2, 3, 4

# What `next_release` tells of the contact that it ends and the flight before it. EFFORT is added to: how much computing
# it took, in events (some 5 us each), so that work can be bounded without a clock.
MEASURED_SIZE = 6
V_IN, V_E, CONTACT_S, APEX_M, PERIOD_S, EFFORT = 0, 1, 2, 3, 4, 5

# Beside exact.MOVING, CAPTURED and LEFT: what was waited for did not come for so long that the search was given up.
# A long pulse that holds the stick in the head comes here, and a head that keeps it swinging (`hysteretic_spring`).
UNDECIDED = 3

# The longest wait for an event is 2^patience times the first one, and a contact may have 16 times as many turns. The
# search for fixed points, sweeps and contacts without pulses ask for less than the rest.
MAX_WAIT_DOUBLINGS, FEW_WAIT_DOUBLINGS = 12, 5
_CREEPING_PATIENCE = 60
_FIRST_WAIT_RAD = 60.0
_NOTHING_M, _NOTHING_M_PER_S = 1e-30, 1e-30
_MAX_WAIT_S = 1e9
_MAX_SAMPLED_WAIT_S = 10.0
_EVENTS_A_WAIT = 16
_WAIT_EFFORT = 4.0
_STIFFEST = 4.0  # how much an effect may raise K_coll


@only_with("pulse")
def _set_pulse(law: Any, motion: Any, left: float, age: float) -> None:
    parameters: decaying_pulse.PulseParameters = law.pulse
    state: decaying_pulse.PulseState = motion.pulse
    state.acceleration = left / parameters.tau
    state.age = age


@only_with("cor_pulse")
def _set_cor_pulse(law: Any, motion: Any, left: float, age: float) -> None:
    parameters: decaying_pulse.PulseParameters = law.cor_pulse
    state: decaying_pulse.PulseState = motion.cor_pulse
    state.acceleration = left / parameters.tau
    state.age = age


@only_with("pulse")
def _read_pulse(law: Any, motion: Any, state: Numbers) -> None:
    parameters: decaying_pulse.PulseParameters = law.pulse
    rest: decaying_pulse.PulseState = motion.pulse
    state[PULSE] = rest.acceleration * parameters.tau
    state[PULSE_AGE] = rest.age


@only_with("cor_pulse")
def _read_cor_pulse(law: Any, motion: Any, state: Numbers) -> None:
    parameters: decaying_pulse.PulseParameters = law.cor_pulse
    rest: decaying_pulse.PulseState = motion.cor_pulse
    state[COR_PULSE] = rest.acceleration * parameters.tau
    state[COR_PULSE_AGE] = rest.age


@njit()
def _oscillates(law: Law, motion: Motion, above: bool) -> bool:
    # Does the stick swing here, rather than creep? Where it creeps, the search for events costs next to nothing.
    if above:
        r = law.r_out - composition.removed_hand_damping(law, motion)
        return r * r < 4.0 * law.m * law.k_hand
    if composition.stiffens(law, motion) or composition.loses_damping(law, motion):
        return True
    return law.r_in * law.r_in < 4.0 * law.m * (law.k_hand + law.k_coll)


@njit()
def _first_wait(law: Law, motion: Motion, above: bool) -> float:
    # For how long, s, to look for the next event at first: some ten oscillations of where the stick is.
    stiffest = _STIFFEST if composition.stiffens(law, motion) else 1.0
    stiffness = law.k_hand if above else law.k_hand + stiffest * law.k_coll
    longest = _MAX_SAMPLED_WAIT_S if composition.acts_by_itself(law, motion, not above) else _MAX_WAIT_S
    return min(_FIRST_WAIT_RAD / math.sqrt(stiffness / law.m), longest) if stiffness > 0.0 else longest


@njit()
def until(law: Law, motion: Motion, wanted: int, patience: int, measured: Numbers) -> tuple[int, float]:
    """Move on to the next `wanted` event; returns how that ended and the seconds moved. measured: EFFORT grows.

    exact.MOVING: it came; exact.CAPTURED, exact.LEFT: it never will; UNDECIDED: it did not come within `patience`.
    """
    moved = 0.0
    waited = 0
    for _ in range(_EVENTS_A_WAIT << patience):
        above = motion.contact_phase == exact.ABOVE
        # Not at once for ever: only between waits is a stick found to be captured by a head that it creeps in.
        event, duration = exact.advance(law, motion, _first_wait(law, motion, above) * 2.0**waited)
        moved += duration
        measured[EFFORT] += (
            _WAIT_EFFORT * 2.0**waited if event == exact.HORIZON and _oscillates(law, motion, above) else 1.0
        )
        if event == wanted and motion.outcome != exact.CAPTURED:
            return exact.MOVING, moved
        if motion.outcome != exact.MOVING:
            return motion.outcome, moved
        if not above and abs(motion.z) < _NOTHING_M and abs(motion.v) < _NOTHING_M_PER_S:
            return exact.CAPTURED, moved  # creeps up to z = 0 for ever, and nothing presses it
        waited = waited + 1 if event == exact.HORIZON else 0
        if (
            waited > (patience if _oscillates(law, motion, above) else _CREEPING_PATIENCE)
            or moved > _MAX_WAIT_S
        ):
            break
    return UNDECIDED, moved


@njit(inline=True)
def next_release(law: Law, motion: Motion, patience: int, measured: Numbers) -> int:
    """Advance from above the head through one contact; returns how that ended, as `until`. measured: shape (6,),
    filled.
    """
    outcome, flight = until(law, motion, exact.ENTRY, patience, measured)
    if outcome == exact.MOVING:
        measured[APEX_M] = motion.z_apex
        outcome, contact = until(law, motion, exact.RELEASE, patience, measured)
        measured[V_IN] = motion.v_in
        measured[V_E] = motion.v_out + composition.remaining_speed(law, motion)
        measured[CONTACT_S] = motion.contact_s
        measured[PERIOD_S] = flight + contact
    return outcome


@njit()
def set_state(law: Law, fresh: Records, motion: Records, state: Numbers) -> None:
    """Put the stick into `state`, at z = 0 going up. fresh, motion: shape (1,); `fresh` is only read."""
    motion[0] = fresh[0]
    motion[0].v = state[V_OUT]
    _set_pulse(law, motion[0], state[PULSE], state[PULSE_AGE])
    _set_cor_pulse(law, motion[0], state[COR_PULSE], state[COR_PULSE_AGE])


@njit()
def iterate(law: Law, motion: Motion, states: Numbers, patience: int, measured: Numbers) -> int:
    """Play on for a number of returns; states: shape (returns, 5), that after each; measured: shape (returns, 6).

    Returns how it ended, as `until`.
    """
    for i in range(states.shape[0]):
        outcome = next_release(law, motion, patience, measured[i])
        if outcome != exact.MOVING:
            return outcome
        states[i, V_OUT] = motion.v_out
        _read_pulse(law, motion, states[i])
        _read_cor_pulse(law, motion, states[i])
    return exact.MOVING


def scratch_of(scene: Scene) -> npt.NDArray[np.void]:
    """Work space of the kernels: shape (2,), a motion and a fresh one."""
    return np.repeat(thrown(scene, 0.0), 2)
