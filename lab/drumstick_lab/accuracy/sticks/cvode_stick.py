"""The stick by SUNDIALS' CVODE, which locates events itself: the same equations and events as `solve_ivp_stick`.

An event-driven code of others, in C; equations and events are Python, as its users write them. By scikit-sundae
(CVODE and its events: https://scikit-sundae.readthedocs.io): pip install scikit-sundae. It is nobody's dependency;
importing this raises ImportError where it is not installed. Any thread; blocks while it computes.
"""

import math
from importlib import import_module
from typing import Any

import numpy as np

from drumstick_lab.accuracy.sticks.solve_ivp_stick import MAX_S, Case, State

_MAX_STEPS = 1_000_000
_ROOT = 2  # its status: an event was located
_cvode: Any = import_module("sksundae.cvode")


class CvodeCase(Case):
    """`Case` that CVODE solves, by the method `Adams` or `BDF`. Its solvers are kept: making one takes longer than a
    stretch."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._solvers: dict[tuple[bool, tuple[int, ...]], Any] = {}
        self._p = 0.0

    def _solver(self, in_contact: bool, ends: tuple[int, ...]) -> Any:
        if (in_contact, ends) not in self._solvers:
            m, tau, (k, r, rest) = self.m, self.tau, self.equation(in_contact)
            asked = [self.event(end) for end in ends]

            def motion(t: float, y: Any, rate: Any) -> None:
                z, v = y.tolist()
                rate[0], rate[1] = v, (rest - k * z - r * v) / m + self._p * math.exp(-t / tau)

            def events(t: float, y: Any, found: Any) -> None:
                state = y.tolist()
                for i, event in enumerate(asked):
                    found[i] = event(t, state)

            described: Any = events
            described.terminal = [True] * len(ends)
            described.direction = [event.direction for event in asked]  # pyright: ignore[reportFunctionMemberAccess]
            self._solvers[in_contact, ends] = _cvode.CVODE(
                motion, eventsfn=events, num_events=len(ends), method=self.method, rtol=self.rtol, atol=self.atol,
                max_num_steps=_MAX_STEPS,
            )  # fmt: skip
        return self._solvers[in_contact, ends]

    def solved(
        self, state: State, in_contact: bool, ends: tuple[int, ...]
    ) -> tuple[float, float, float, int]:
        """Seconds to the first of these ends, height and speed there, and which it was."""
        solver = self._solver(in_contact, ends)
        self._p = state.p
        solver.init_step(0.0, np.array([state.z, state.v]))
        found = solver.step(MAX_S)
        if found.status != _ROOT:
            raise RuntimeError(f"nothing happened within {MAX_S} s from {state}")
        z, v = found.y.tolist()
        which = int(np.flatnonzero(found.i_events[-1])[0])
        return float(found.t), z, v, ends[which]
