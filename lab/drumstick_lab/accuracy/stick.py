"""Cost of the stick's accuracy: every method over its step, with and without event location, beside `exact`.

The scene is `roll`. Errors are relative to `exact`, whose own error is rounding (EXACT_ERROR); CPU time is that of the
thread for a simulated second, of a whole run as `drumstick simulate` makes it. Peers do the same over their tolerance,
with terminal events, where they are installed: scipy's solve_ivp by DOP853, LSODA and Radau; SUNDIALS' CVODE by Adams
and BDF (scikit-sundae, which nothing else needs). Any thread; blocks while it computes.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.methods.carry import ORDERS, STEPPERS
from drumstick.stick.simulate import EXACT, Stepper, simulate
from drumstick_lab.accuracy.job import Job
from drumstick_lab.accuracy.sticks.contacts import AVERAGED, COMPARED, SETTLED, Contacts, Errors, errors
from drumstick_lab.accuracy.timing import CHAIN, Window, chain, each_in_turn, median_band, spent_ns

SCENE = "roll"
PEER = "solve_ivp"
# An explicit method of high order, one that chooses between stiff and not, an implicit one for what is stiff; multistep
# methods for either, in C.
PEERS = {
    PEER: "DOP853",
    "solve_ivp, LSODA": "LSODA",
    "solve_ivp, Radau": "Radau",
    "CVODE, Adams": "Adams",
    "CVODE, BDF": "BDF",
}
# What each needs: its module, its distribution, and what to type for it.
_SCIPY = ("scipy", "scipy", "haptic-drumstick[sound]")
_SUNDAE = ("sksundae", "scikit-sundae", "scikit-sundae")
NEEDS = {peer: _SUNDAE if peer.startswith("CVODE") else _SCIPY for peer in PEERS}
# Largest relative error of any instant or speed within 100 contacts of this scene against 40 digits: 2.9e-15 by
# drumstick lab stick-methods
EXACT_ERROR = 3e-15
STEPS_S = tuple(float(f"{x:.3g}") for x in 1e-3 / np.sqrt(10.0) ** np.arange(7))
TOLERANCES = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_TRIED = dict.fromkeys(PEERS, len(TOLERANCES)) | {
    "solve_ivp, Radau": 3
}  # of order 5: from there on minutes a run
ATOL_PER_RTOL = 1e-2  # heights are of centimetres
ROUNDS, QUICK_ROUNDS = 40, 10  # neighbours on the processor come and go within seconds
_AIMED_AT = SETTLED + AVERAGED  # contacts
_SLOWEST = 0.8  # of the true rate: a roll that is slower yet is another roll
_STEPS_A_WINDOW = 200_000
_SHORTEST_S, _MAX_S = 1.0, 50.0  # simulated in a window: making a run's memory must not count


class Sweep(NamedTuple):
    """One method over its steps (s), or the peer over its rtol."""

    method: str
    locates: bool
    sizes: tuple[float, ...]


FULL = (
    *(Sweep(method, locates, STEPS_S) for method in STEPPERS for locates in (True, False)),
    *(Sweep(peer, True, TOLERANCES[: _TRIED[peer]]) for peer in PEERS),
)
# What tells most comes first: the best stepper, the usual force loop, the peer, and the others beside them.
_FEW_STEPS_S = (3.16e-4, 1e-4, 1e-5)
QUICK = (
    Sweep("rk4", True, _FEW_STEPS_S),
    Sweep("semi_implicit_euler", False, _FEW_STEPS_S),
    Sweep(PEER, True, (1e-4, 1e-10)),
    Sweep("rk4", False, _FEW_STEPS_S),
    Sweep("semi_implicit_euler", True, _FEW_STEPS_S),
    Sweep("verlet", True, _FEW_STEPS_S),
    Sweep("verlet", False, _FEW_STEPS_S),
    Sweep("implicit_midpoint", True, _FEW_STEPS_S),
    Sweep("implicit_midpoint", False, _FEW_STEPS_S),
)


class Roll:
    """The scene, and how `exact` plays it."""

    def __init__(self) -> None:
        self.scene = parse(shipped_text(SCENE), SCENE)
        self.throw = self.scene.hand.throw_m_per_s

    @cached_property
    def truth(self) -> Contacts:
        """SETTLED + AVERAGED contacts by `exact`."""
        duration_s = 1.0
        while len(found := simulate(self.scene, duration_s, self.throw).contacts) < _AIMED_AT:
            duration_s *= 2.0
        return found[:_AIMED_AT]

    def errors_of(self, stepper: Stepper | None) -> Errors:
        """Errors of a stepper, or of `exact` for None: none, by definition."""
        duration_s = float(self.truth[-1, 2]) / _SLOWEST
        return errors(simulate(self.scene, duration_s, self.throw, stepper).contacts, self.truth)

    def errors_of_peer(self, rtol: float, peer: str = PEER) -> Errors:
        """Errors of a peer. Raises ImportError where it is not installed."""
        return errors(self.peers(_AIMED_AT, rtol, peer), self.truth)

    def peers(self, count: int, rtol: float, peer: str = PEER) -> Contacts:
        """So many contacts by a peer."""
        from drumstick_lab.accuracy.sticks.solve_ivp_stick import Case, played

        case = Case
        if NEEDS[peer] is _SUNDAE:
            from drumstick_lab.accuracy.sticks.cvode_stick import CvodeCase

            case = CvodeCase
        return played(case(self.scene, rtol, ATOL_PER_RTOL * rtol, PEERS[peer]), count, self.throw).contacts

    def window(self, stepper: Stepper | None) -> Window:
        """CPU ns for a simulated second of a stepper, or of `exact`."""
        wanted_s = _MAX_S if stepper is None else _STEPS_A_WINDOW * stepper.dt_s
        play = partial(simulate, self.scene, min(max(wanted_s, _SHORTEST_S), _MAX_S), self.throw, stepper)
        lasted_s = play().t_end_s  # less when the stick leaves
        return lambda: spent_ns(play) / lasted_s

    def window_of_peer(self, rtol: float, peer: str = PEER) -> Window:
        """CPU ns for a simulated second of a peer, over the contacts that are compared."""
        play = partial(self.peers, COMPARED, rtol, peer)
        lasted_s = float(play()[-1, 2])
        return lambda: spent_ns(play) / lasted_s


class _Point(NamedTuple):
    # What becomes a row: its first keys, its errors, and what to time.
    keys: dict[str, Any]
    errors: Errors
    window: Window


def _keys(method: str, locates: bool, dt_s: float | None = None, rtol: float | None = None) -> dict[str, Any]:
    return {"method": method, "locates": locates, "dt_s": dt_s, "rtol": rtol}


def _exact(roll: Roll) -> list[_Point]:
    return [_Point(_keys(EXACT, True), roll.errors_of(None), roll.window(None))]


def _stepped(roll: Roll, sweep: Sweep) -> list[_Point]:
    steppers = [Stepper(sweep.method, dt_s, sweep.locates) for dt_s in sweep.sizes]
    return [
        _Point(_keys(sweep.method, sweep.locates, dt_s=each.dt_s), roll.errors_of(each), roll.window(each))
        for each in steppers
    ]


def _peers(roll: Roll, sweep: Sweep) -> list[_Point]:
    return [
        _Point(
            _keys(sweep.method, True, rtol=rtol),
            roll.errors_of_peer(rtol, sweep.method),
            roll.window_of_peer(rtol, sweep.method),
        )
        for rtol in sweep.sizes
    ]


def _rows(points: list[_Point], times: Mapping[str, list[float]]) -> list[dict[str, Any]]:
    # ns of each point by its number, beside the yardstick's that their ratio is taken to.
    ns = {name: min(each) for name, each in times.items()}
    return [
        point.keys
        | {
            "ns_per_s": ns[str(i)],
            "median_ns": median_band(times[str(i)]),
            "ratio": ns[str(i)] / ns[CHAIN],
            "error_contacts": point.errors.contacts,
            "error_v_lc": point.errors.v_lc,
            "error_rate": point.errors.rate,
            "missed": None in point.errors,
        }
        for i, point in enumerate(points)
    ]


def _version(peer: str) -> str:
    module, distribution, typed = NEEDS[peer]
    if find_spec(module) is None:
        return f"not installed: pip install {typed}"
    return f"{distribution} {version(distribution)}"


def _words(sweep: Sweep) -> str:
    if sweep.method in PEERS:
        return f"stick: {NEEDS[sweep.method][1]}, {PEERS[sweep.method]}"
    return f"stick: {sweep.method}, events {'located' if sweep.locates else 'seen at the end of a step'}"


def jobs(quick: bool, found: dict[str, Any]) -> Iterator[Job]:
    """One for `exact`, one for each sweep, and one that times all of them in the same rounds; `found` gets scene,
    orders, exact_error, a row for each step, and yardstick_ns.

    A row's ns_per_s is the least; between the two of its median_ns lies the median with 95 % confidence. Its errors are
    null where `missed`: the roll dies, leaves, or becomes one that is slower by a fifth. found["peers"] has the version of
    each peer, or, in place of its rows, what to install for them.
    """
    rows: list[dict[str, Any]] = []
    found |= {"scene": SCENE, "orders": dict(ORDERS), "exact_error": EXACT_ERROR, "rows": rows}
    found["peers"] = {peer: _version(peer) for peer in PEERS}
    roll, points = Roll(), list[_Point]()

    def add(more: Callable[[], list[_Point]]) -> None:
        points.extend(more())

    def time() -> None:
        windows = {str(i): point.window for i, point in enumerate(points)} | {CHAIN: chain()}
        times = each_in_turn(windows, QUICK_ROUNDS if quick else ROUNDS)
        rows.extend(_rows(points, times))
        found["yardstick_ns"] = {CHAIN: min(times[CHAIN])}

    yield Job("stick: exact", partial(add, partial(_exact, roll)))
    for sweep in QUICK if quick else FULL:
        if sweep.method in PEERS and find_spec(NEEDS[sweep.method][0]) is None:
            continue
        yield Job(
            _words(sweep), partial(add, partial(_peers if sweep.method in PEERS else _stepped, roll, sweep))
        )
    yield Job("stick: all in turn", time)
