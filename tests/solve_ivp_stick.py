"""The stick as a user of scipy would simulate it: `solve_ivp` with terminal events, restarted at every one of them.

Equations (1), (2) and (4) written down once more, without anything of ours: it is the baseline for cost and error.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

METHOD, RTOL, ATOL = "DOP853", 1e-10, 1e-12
LONGEST_S = 1.0  # no flight and no contact of the cases lasts longer

Event = Callable[[float, Sequence[float]], float]
Row = dict[str, str]


class State(NamedTuple):
    """Time (s), height (m), speed (m/s), the pulse's acceleration (m/s^2)."""

    t: float
    z: float
    v: float
    p: float


class Case:
    """One row of limit_cycles.csv."""

    def __init__(self, row: Row) -> None:
        self.m, self.k_coll, self.r_in, self.k_hand, self.r_out, self.z_ss, self.dv, self.tau = (
            float(row[key]) for key in ("m", "K_coll", "R_in", "K_hand", "R_out", "z_ss", "dv", "tau")
        )
        self.trigger, self.sign = row["trigger"], int(row["sign"])
        self.pushes_only = row["release"] == "force"

    def push(self, z: float, v: float) -> float:
        """Force of the head, N; the hand's R_out of equation (1) is still there inside."""
        return -self.k_coll * z - (self.r_in - self.r_out) * v

    def fire(self, state: State, when: str) -> State:
        """Add a pulse if it fires now."""
        return state._replace(p=state.p + self.sign * self.dv / self.tau) if self.trigger == when else state

    def go(self, state: State, in_contact: bool, *events: Event) -> tuple[State, int]:
        """On to the first of these events; which one it was."""
        m, k, r, rest = self.m, self.k_hand, self.r_out, self.k_hand * self.z_ss
        if in_contact:
            k, r = k + self.k_coll, self.r_in
        start, p, tau = state.t, state.p, self.tau

        def motion(t: float, y: Sequence[float]) -> tuple[float, float]:
            z, v = y
            return v, (rest - k * z - r * v) / m + p * math.exp(-(t - start) / tau)

        span = state.t, state.t + LONGEST_S
        found = solve_ivp(
            motion, span, (state.z, state.v), method=METHOD, rtol=RTOL, atol=ATOL, events=events
        )
        if found.status != 1:
            raise RuntimeError(f"nothing happened within {LONGEST_S} s from {state}")
        t, (z, v) = float(found.t[-1]), found.y[:, -1]
        which = next(i for i, times in enumerate(found.t_events) if len(times))
        return State(t, float(z), float(v), p * math.exp(-(t - start) / tau)), which


def _terminal(event: Event, direction: int) -> Event:
    event.terminal, event.direction = True, direction  # pyright: ignore[reportFunctionMemberAccess]
    return event


def contacts(row: Row, count: int, v0: float = 0.4) -> npt.NDArray[np.float64]:
    """t_in, v_in, t_out, v_out of the first contacts of a stick thrown upward from z = 0; shape (count, 4)."""
    case = Case(row)
    down, up = _terminal(lambda t, y: y[0], -1), _terminal(lambda t, y: y[0], 1)
    turn = _terminal(lambda t, y: y[1], 1)
    loosen = _terminal(lambda t, y: case.push(y[0], y[1]), -1)
    resume = _terminal(lambda t, y: case.push(y[0], y[1]), 1)
    state = State(0.0, 0.0, v0, 0.0)
    rows: list[tuple[float, float, float, float]] = []
    while len(rows) < count:
        state, _ = case.go(state, False, down)
        entry = state
        state = case.fire(state._replace(z=0.0), "entry")
        if case.trigger == "turn":
            state, _ = case.go(state, True, turn)
            state = case.fire(state, "turn")
        out, holds = False, True
        while not out:
            if holds and not case.pushes_only:
                state, _ = case.go(state, True, up)
                out = True
            elif holds:
                state, which = case.go(state, True, loosen, up)
                out, holds = which == 1, False
            else:
                state, which = case.go(state, False, up, resume)
                out, holds = which == 0, True
        rows.append((entry.t, entry.v, state.t, state.v))
        state = case.fire(state._replace(z=0.0), "exit")
    return np.array(rows)
