"""The cases on which the methods are compared, and what a bounce costs: CPU time and error, in windows of equal work.

Windows of different methods are to be measured in turn, and the best of each taken: what else the machine does then
falls on both, or on neither.
"""

import functools
import time
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import mp_stick
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.methods.carry import STEPPERS
from drumstick.stick.motion import exact, stepping
from drumstick.stick.records import Law
from drumstick.stick.simulate import Stepper, simulate
from drumstick_lab.accuracy.sticks import solve_ivp_stick
from drumstick_lab.accuracy.sticks.contacts import Contacts, largest_error
from realtime.kernels.jit import njit

THROW_M_PER_S = 0.4
COPIES = 200  # throws in one window of a compiled method: about a millisecond
_MAX_S = 1.0


def _shipped(name: str, pulse: dict[str, Any] | None = None, **stick: Any) -> Scene:
    scene = parse(shipped_text(name), name)
    effects = scene.effects if pulse is None else {"pulse": replace(scene.effects["pulse"], **pulse)}
    return replace(scene, stick=replace(scene.stick, **stick), effects=effects)


class Case(NamedTuple):
    """A scene, and how many of its first contacts are looked at."""

    words: str
    scene: Scene
    bounces: int


CASES = {
    "roll": Case("scene `roll`: released at z = 0, the pulse at release", _shipped("roll"), 8),
    "paper-roll": Case("scene `paper-roll`: the pulse at contact", _shipped("paper-roll"), 8),
    "turn": Case("`roll`, the pulse at the deepest point", _shipped("roll", {"trigger": "turn"}), 8),
    "unilateral": Case("`roll`, a head that only pushes", _shipped("roll", release="unilateral"), 8),
    "low": Case("`roll` with half the pulse: a low, quick roll", _shipped("roll", {"dv_m_per_s": 0.1}), 8),
    "quick": Case(
        "a quick pulse into the drum, 10 µs",
        _shipped("roll", {"trigger": "entry", "sign": -1, "tau_s": 1e-5}),
        8,
    ),
    "soft": Case(
        "`roll` on a soft head, 500 N/m", _shipped("roll", k_coll_N_per_m=500.0, r_in_N_s_per_m=0.4), 8
    ),
    "hard": Case(
        "`roll` on a hard head, 1e5 N/m", _shipped("roll", k_coll_N_per_m=1e5, r_in_N_s_per_m=6.0), 8
    ),
    "phantom": Case("scene `phantom`: a heavy stick, a head that only pushes", _shipped("phantom"), 8),
    "dropped": Case("scene `bare-drum`: a throw that decays, no pulse", _shipped("bare-drum"), 5),
}


@functools.cache
def played_by_scipy(name: str) -> solve_ivp_stick.Played:
    """The case by solve_ivp."""
    return solve_ivp_stick.play(CASES[name].scene, CASES[name].bounces, THROW_M_PER_S)


@functools.cache
def reference(name: str) -> Contacts:
    """t_in, v_in, t_out, v_out of the case's contacts to the last digit, shape (bounces, 4)."""
    return mp_stick.contacts(CASES[name].scene, played_by_scipy(name), THROW_M_PER_S)


def contacts(name: str, stepper: Stepper | None = None) -> Contacts:
    """The case's contacts by `exact` or a stepper, as many as there are in its time."""
    duration = float(reference(name)[-1, 2]) * 1.02
    return simulate(CASES[name].scene, duration, THROW_M_PER_S, stepper).contacts[:, :4]


@njit()
def _play(
    law: Law, motions: Records, releases: int, horizon: float, method: int | None, dt: float, locates: bool
) -> int:
    events = 0
    for i in range(len(motions)):
        motion, out = motions[i], 0
        while out < releases and motion.outcome == exact.MOVING:
            if method is None:
                event, _ = exact.advance(law, motion, horizon)
            elif locates:
                event, _ = stepping.located(law, motion, horizon, method, dt)
            else:
                event, _ = stepping.unlocated(law, motion, horizon, method, dt)
            events += event != exact.HORIZON
            out += event == exact.RELEASE
    return events


class Window:
    """The same throws again and again by a compiled method; each call gives the CPU seconds a bounce took.

    `tick_s`: as a servo does it, no further than so many seconds at a time.
    """

    def __init__(
        self, name: str, stepper: Stepper | None = None, copies: int = COPIES, tick_s: float = _MAX_S
    ) -> None:
        self._law, self._start = law_of(CASES[name].scene), thrown(CASES[name].scene, THROW_M_PER_S)
        self._bounces, self._copies, self._tick_s = CASES[name].bounces, copies, tick_s
        self._method = None if stepper is None else STEPPERS[stepper.name]
        self._dt_s, self._locates = (0.0, True) if stepper is None else (stepper.dt_s, stepper.locates)
        self.events_per_bounce = self._run(1)[1]

    def _run(self, copies: int) -> tuple[float, float]:
        motions = np.repeat(self._start, copies)
        begun = time.thread_time()
        events = _play(
            self._law[0], motions, self._bounces, self._tick_s, self._method, self._dt_s, self._locates
        )
        bounces = copies * self._bounces
        return (time.thread_time() - begun) / bounces, events / bounces

    def __call__(self) -> float:
        return self._run(self._copies)[0]


def scipy_window(name: str, rtol: float = solve_ivp_stick.RTOL, atol: float = solve_ivp_stick.ATOL) -> float:
    """CPU seconds a bounce by solve_ivp took."""
    case = CASES[name]
    begun = time.thread_time()
    solve_ivp_stick.play(case.scene, case.bounces, THROW_M_PER_S, rtol, atol)
    return (time.thread_time() - begun) / case.bounces


def error_after(name: str, count: int) -> float:
    """The error of `exact` over so many contacts."""
    scene = CASES[name].scene
    true = mp_stick.contacts(scene, solve_ivp_stick.play(scene, count, THROW_M_PER_S), THROW_M_PER_S)
    found = simulate(scene, float(true[-1, 2]) * 1.02, THROW_M_PER_S).contacts[:, :4]
    return largest_error(found, true)
