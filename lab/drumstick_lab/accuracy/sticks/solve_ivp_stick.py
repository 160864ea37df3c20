"""The stick as a user of scipy would simulate it: `solve_ivp` with terminal events, restarted at every one of them.

Equations (1), (2) and (4) written down once more, without anything of ours but the scene's numbers: it is the baseline
for cost and error, here and in tests. What makes scipy quick is done: no event that is not needed, plain floats instead
of numpy's. Importing it raises ImportError where scipy is not installed. Any thread; blocks while it computes.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import integrate

from drumstick.parameters.scene import Scene
from drumstick.stick.effects.pulse import Pulse

METHOD, RTOL, ATOL = "DOP853", 1e-10, 1e-12
MAX_S = 1.0  # no flight and no contact of the cases lasts longer
# What ends a stretch of motion: z = 0 on the way down or up, the deepest point, a push that falls or rises through 0.
ENTRY, RELEASE, TURN, SEPARATION, RECONTACT = range(5)

Event = Callable[[float, Sequence[float]], float]
_integrate: Any = integrate  # scipy publishes no types


class State(NamedTuple):
    """Time (s), height (m), speed (m/s), the pulse's acceleration (m/s^2)."""

    t: float
    z: float
    v: float
    p: float


class Stretch(NamedTuple):
    """One call of solve_ivp: did a pulse fire before it, which equation it solved, what ended it, after how long."""

    fired: bool
    in_contact: bool
    ended_by: int
    duration_s: float


class Played(NamedTuple):
    """The contacts, shape (count, 5), the first columns of drumstick.stick.simulate.COLUMNS; the stretches between
    events."""

    contacts: npt.NDArray[np.float64]
    stretches: list[Stretch]


class Case:
    """A scene with or without a `pulse` whose overlap is `add`; no other effect."""

    def __init__(self, scene: Scene, rtol: float = RTOL, atol: float = ATOL, method: str = METHOD) -> None:
        stick = scene.stick
        self.m, self.k_coll, self.r_in = stick.m_kg, stick.k_coll_N_per_m, stick.r_in_N_s_per_m
        self.k_hand, self.r_out, self.z_ss = stick.k_hand_N_per_m, stick.r_out_N_s_per_m, stick.z_ss_m
        self.pushes_only = stick.release == "unilateral"
        if set(scene.effects) - {"pulse"}:
            raise ValueError(f"this baseline knows no effect but the pulse, not {', '.join(scene.effects)}")
        pulse = scene.effects.get("pulse", Pulse(dv_m_per_s=0.0, trigger="exit"))
        assert pulse.overlap == "add"
        self.tau, self.kick, self.trigger = (
            pulse.tau_s,
            pulse.sign * pulse.dv_m_per_s / pulse.tau_s,
            pulse.trigger,
        )
        self.rtol, self.atol, self.method = rtol, atol, method
        self.stretches: list[Stretch] = []
        self._fired = False

    def push(self, z: float, v: float) -> float:
        """Force of the head, N; the hand's R_out of equation (1) is still there inside."""
        return -self.k_coll * z - (self.r_in - self.r_out) * v

    def fire(self, state: State, when: str) -> State:
        """Add a pulse if it fires now."""
        self._fired = self.trigger == when
        return state._replace(p=state.p + self.kick) if self._fired else state

    def equation(self, in_contact: bool) -> tuple[float, float, float]:
        """Stiffness (N/m), damping (N s/m) and constant force (N) of m z'' = force - k z - r z' + m p."""
        rest = self.k_hand * self.z_ss
        return (self.k_hand + self.k_coll, self.r_in, rest) if in_contact else (self.k_hand, self.r_out, rest)

    def go(self, state: State, in_contact: bool, *ends: int) -> tuple[State, int]:
        """On to the first of these ends; which one it was. RuntimeError when none comes."""
        duration, z, v, which = self.solved(state, in_contact, ends)
        self.stretches.append(Stretch(self._fired, in_contact, which, duration))
        self._fired = False
        return State(state.t + duration, z, v, state.p * math.exp(-duration / self.tau)), which

    def solved(
        self, state: State, in_contact: bool, ends: tuple[int, ...]
    ) -> tuple[float, float, float, int]:
        """Seconds to the first of these ends, height and speed there, and which it was. RuntimeError when none comes."""
        m, (k, r, rest) = self.m, self.equation(in_contact)
        start, p, tau = state.t, state.p, self.tau

        def motion(t: float, y: npt.NDArray[np.float64]) -> tuple[float, float]:
            z, v = y.tolist()
            return v, (rest - k * z - r * v) / m + p * math.exp(-(t - start) / tau)

        found: Any = _integrate.solve_ivp(
            motion, (state.t, state.t + MAX_S), (state.z, state.v), method=self.method, rtol=self.rtol, atol=self.atol,
            events=[self.event(end) for end in ends],
        )  # fmt: skip
        if found.status != 1:
            raise RuntimeError(f"nothing happened within {MAX_S} s from {state}")
        z, v = found.y[:, -1].tolist()
        which = ends[next(i for i, times in enumerate(found.t_events) if len(times))]
        return float(found.t[-1]) - start, z, v, which

    def event(self, end: int) -> Event:
        """A terminal event as scipy wants one."""
        if end in (ENTRY, RELEASE):
            return _terminal(lambda t, y: y[0], -1 if end == ENTRY else 1)
        if end == TURN:
            return _terminal(lambda t, y: y[1], 1)
        return _terminal(lambda t, y: self.push(y[0], y[1]), -1 if end == SEPARATION else 1)


def _terminal(event: Event, direction: int) -> Event:
    event.terminal, event.direction = True, direction  # pyright: ignore[reportFunctionMemberAccess]
    return event


def _through_the_head(case: Case, state: State) -> State:
    if case.trigger == "turn":
        state = case.fire(case.go(state, True, TURN)[0], "turn")
    if not case.pushes_only:
        return case.go(state, True, RELEASE)[0]
    end = RECONTACT
    while end != RELEASE:
        in_contact = end == RECONTACT
        state, end = case.go(state, in_contact, SEPARATION if in_contact else RECONTACT, RELEASE)
    return state


def play(
    scene: Scene, count: int, v0: float = 0.4, rtol: float = RTOL, atol: float = ATOL, method: str = METHOD
) -> Played:
    """The first `count` contacts of a stick thrown upward from z = 0 at v0 m/s. RuntimeError when one does not come."""
    return played(Case(scene, rtol, atol, method), count, v0)


def played(case: Case, count: int, v0: float) -> Played:
    """The first `count` contacts of a case, likewise."""
    state = State(0.0, 0.0, v0, 0.0)
    rows: list[tuple[float, ...]] = []
    while len(rows) < count:
        entry, _ = case.go(state, False, ENTRY)
        state = _through_the_head(case, case.fire(entry._replace(z=0.0), "entry"))
        out = case.fire(state._replace(z=0.0), "exit")
        rows.append((entry.t, entry.v, state.t, state.v, out.v + out.p * case.tau))
        state = out
    return Played(np.array(rows), case.stretches)
