"""Multiplier of a cycle: growth of a small departure in one round.

The Jacobian of the whole return, all components of the state, by central differences that are extrapolated to a step of
zero (Ridders, "Accurate computation of F'(x)", 1982). Any thread; blocks for under a millisecond.
"""

import math

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.return_step import Numbers
from drumstick.stick.motion import exact
from realtime.records import Records

_FIRST_STEP = 2e-2  # of the cycle's speed
_SHRINK = 2.0
_STEPS, _ORDERS = 12, 4
_ROOM = 1e-3


def active(law: Records) -> list[int]:
    """The components of the state that the scene has: v_out, and the rest of each pulse it names."""
    names = law.dtype.names or ()
    return [
        return_step.V_OUT,
        *(
            c
            for c, name in ((return_step.PULSE, "pulse"), (return_step.COR_PULSE, "cor_pulse"))
            if name in names
        ),
    ]


def after(law: Records, scratch: Records, state: Numbers, returns: int) -> Numbers | None:
    """The state `returns` later, shape (5,); None when the stick does not come round."""
    states = np.zeros((returns, return_step.STATE_SIZE))
    return_step.set_state(law[0], scratch[1:], scratch[:1], state)
    outcome = return_step.iterate(
        law[0],
        scratch[0],
        states,
        return_step.MAX_WAIT_DOUBLINGS,
        np.zeros((returns, return_step.MEASURED_SIZE)),
    )
    return states[-1] if outcome == exact.MOVING else None


def _slope(
    law: Records, scratch: Records, state: Numbers, returns: int, component: int, step: float, two_sided: bool
) -> Numbers | None:
    # One difference quotient, shape (5,); None when a neighbour does not come round.
    up, down = state.copy(), state.copy()
    up[component] += step
    if two_sided:
        down[component] -= step
    above, below = after(law, scratch, up, returns), after(law, scratch, down, returns)
    if above is None or below is None:
        return None
    return (above - below) / (up[component] - down[component])


def _column(law: Records, scratch: Records, state: Numbers, returns: int, component: int) -> Numbers | None:
    # One column of the Jacobian, shape (5,), from Ridders' table; None when no two neighbours come round.
    size = float(np.sum(np.abs(state[: return_step.PULSE_AGE])))
    # A pulse can be all of the speed: then there is no room below v_out for steps that rounding does not spoil.
    two_sided = component != return_step.V_OUT or state[return_step.V_OUT] > _ROOM * size
    step = _FIRST_STEP * size
    if component == return_step.V_OUT and two_sided:
        step = min(step, 0.5 * state[return_step.V_OUT])
    shrink = _SHRINK * _SHRINK if two_sided else _SHRINK  # what the error shrinks by, and every order more
    last: list[Numbers] = []
    best, error = None, math.inf
    for _ in range(_STEPS):
        slope = _slope(law, scratch, state, returns, component, step, two_sided)
        step /= _SHRINK
        if slope is None:
            last = []
            continue
        row = [slope]
        for order, before in enumerate(last[:_ORDERS]):
            better = row[order] + (row[order] - before) / (shrink ** (order + 1) - 1.0)
            apart = max(float(np.max(np.abs(better - row[order]))), float(np.max(np.abs(better - before))))
            if apart < error:
                best, error = better, apart
            row.append(better)
        last = row
    return best


def jacobian(law: Records, scratch: Records, state: Numbers, returns: int) -> Numbers | None:
    """d(state after `returns`)/d(state), shape (d, d) over the `active` components; None beside a jump of the map."""
    kept = active(law)
    columns: list[Numbers] = []
    for component in kept:
        column = _column(law, scratch, state, returns, component)
        if column is None:
            return None
        columns.append(column[kept])
    return np.stack(columns, axis=1)


def dominant(matrix: Numbers) -> float:
    """The eigenvalue of largest modulus; a complex pair is given by its modulus."""
    values = np.linalg.eigvals(matrix)
    largest = values[int(np.argmax(np.abs(values)))]
    return float(largest.real) if abs(largest.imag) <= 1e-9 * abs(largest) else float(abs(largest))
