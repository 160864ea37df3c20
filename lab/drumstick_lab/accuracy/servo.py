"""Head as rendered on a sampled device: restitution, energy added, and the ticks' cost.

Over rate, prediction, delay and speed filter. The servo has one filter (drumstick_lab.accuracy.sticks.filters names it ADAPTIVE); its
restitution is measured by the text that plays. The other filters, which stand in for those of other force loops, take
its place in the same fall. A tick's cost is that of the servo's whole tick as it runs (orders, latch, filter, law,
guard, trace, status; no sleep), on an arm that strokes a head of the lowest stiffness at that rate, prediction and
delay; for another filter the servo's own is taken off and that one added, both timed over these strokes' positions.
CPU time of the thread. Any thread; blocks while it computes.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import groupby, product
from typing import Any, NamedTuple

import numpy as np

from drumstick_lab.accuracy.job import Job
from drumstick_lab.accuracy.sticks import falling
from drumstick_lab.accuracy.sticks.falling import PREDICTORS, Sampled, servo_of
from drumstick_lab.accuracy.sticks.filters import ADAPTIVE, FILTERS, Samples, estimated_speeds
from drumstick_lab.accuracy.timing import CHAIN, Window, chain, in_turn, spent_ns
from haptic_server.limits import lag_s
from haptic_server.records import NO_FAULT
from haptic_server.servo import loop
from haptic_server.servo.trace import TICKS, ordered

STIFFNESSES = (250.0, 500.0, 1000.0, 2000.0, 3500.0)  # N/m
RATES_HZ = (500, 1000, 2000, 4000)
DELAYS = (0, 1, 2)  # ticks
ROUNDS = 60  # of some ms for each device: neighbours on the processor come and go within seconds
_BLOCKS = 5  # of TICKS ticks in a window: as many as the trace keeps


class Case(NamedTuple):
    """Ticks a second, ticks of delay, N/m; each is tried with and without prediction, with every filter."""

    rate_Hz: int
    delay_ticks: int
    k_coll: float


FULL = tuple(Case(*case) for case in product(RATES_HZ, DELAYS, STIFFNESSES))
# The usual rate first, then what faster ones and slower devices make of it; a rate and delay stay together.
QUICK = (
    Case(1000, 0, 3500.0),
    Case(1000, 0, 1000.0),
    Case(4000, 0, 3500.0),
    Case(4000, 0, 1000.0),
    Case(1000, 1, 3500.0),
    Case(1000, 1, 1000.0),
    Case(4000, 1, 3500.0),
    Case(4000, 1, 1000.0),
    Case(2000, 0, 3500.0),
    Case(500, 0, 1000.0),
)
QUICK_FILTERS = (ADAPTIVE, "difference", "low-pass 100 Hz")


class _Strokes:
    # A servo whose arm is stroking: whole ticks of it, and each filter alone over the positions that it was told.
    def __init__(self, device: Sampled) -> None:
        self._scene = device.scene(strokes=True)
        self._servo, self._now_ns = servo_of(self._scene), 0
        self._z_m = np.concatenate([self._block() for _ in range(_BLOCKS)])
        self._speeds = np.empty_like(self._z_m)
        tick_state = self._servo.tick_state[0]
        if tick_state["fault"] != NO_FAULT or tick_state["seq"] == 0:
            raise RuntimeError(f"{device}: fault {tick_state['fault']} after {tick_state['seq']} strikes")

    def _run(self, ticks: int) -> None:
        self._now_ns = loop.run_virtual(self._servo, ticks, self._now_ns)

    def _block(self) -> Samples:
        self._run(TICKS)
        rows = ordered(self._servo.trace, int(self._servo.tick_state[0]["traced"]))
        return np.ascontiguousarray(rows["told_z_m"])

    def ticks(self) -> float:
        """ns of CPU for a whole tick."""
        ticks = _BLOCKS * TICKS
        return spent_ns(lambda: self._run(ticks)) / ticks

    def filtering(self, kind: str) -> Window:
        """ns of CPU for one estimate of the speed."""
        period_s = 1.0 / self._scene.servo.rate_Hz
        slack_m = float(self._servo.device_limits[0]["resolution_m"])
        work = partial(estimated_speeds, kind, self._z_m, period_s, slack_m, self._speeds)
        return lambda: spent_ns(work) / len(self._z_m)


class Costs(NamedTuple):
    """ns of CPU for a tick, by device (stroking the softest head) and filter, and of CHAIN in the same rounds."""

    tick_ns: dict[tuple[Sampled, str], float]
    chain_ns: float


def tick_costs(cases: Iterable[Case], filters: Sequence[str], rounds: int = ROUNDS) -> Costs:
    """All in turn. RuntimeError when an arm does not stroke, or a fault is latched."""
    devices = dict.fromkeys(_softest(case, predictor) for case in cases for predictor in PREDICTORS)
    windows: dict[str, Window] = {}
    for device in devices:
        strokes = _Strokes(device)
        windows[f"{device}"] = strokes.ticks
        windows |= {
            f"{device} {kind}": strokes.filtering(kind) for kind in dict.fromkeys((ADAPTIVE, *filters))
        }
    ns = in_turn(windows | {CHAIN: chain()}, rounds)
    others = {device: ns[f"{device}"] - ns[f"{device} {ADAPTIVE}"] for device in devices}
    tick_ns = {
        (device, kind): others[device] + ns[f"{device} {kind}"] for device in devices for kind in filters
    }
    return Costs(tick_ns, ns[CHAIN])


def _softest(case: Case, predictor: str) -> Sampled:
    return Sampled(STIFFNESSES[0], case.rate_Hz, case.delay_ticks, predictor)


def _given_back(device: Sampled, kind: str) -> dict[str, Any]:
    # `missed`: at some phase the arm did not come back.
    scene, wanted = device.scene(), falling.design(device.k_coll)
    free, guarded = (falling.rebounds(scene, guarded, kind) for guarded in (False, True))
    missed = min(*free, *guarded) < 0.0
    found = dict.fromkeys(("mean", "least", "most")) if missed else falling.spread(free)
    led_s = lag_s(scene) if device.predictor == "lead" else 0.0
    return {
        "restitution": found,
        "design": wanted,
        "theory": falling.theory(device.k_coll, lag_s(scene) - led_s),
        "energy": None if missed else float(np.mean(np.square(free))) - wanted**2,
        "guarded_most": None if missed else max(guarded),
        "passes_envelope": falling.passes(scene),
        "ticks_in_contact": falling.ticks_in_contact(device.k_coll, device.rate_Hz),
        "missed": missed,
    }


def _rows(cases: list[Case], filters: Sequence[str], costs: Costs) -> Iterator[dict[str, Any]]:
    for case, predictor, kind in product(cases, PREDICTORS, filters):
        device = Sampled(case.k_coll, case.rate_Hz, case.delay_ticks, predictor)
        tick_ns = costs.tick_ns[_softest(case, predictor), kind]
        cost = {
            "tick_ns": tick_ns,
            "share_of_core": tick_ns * 1e-9 * case.rate_Hz,
            "ratio": tick_ns / costs.chain_ns,
        }
        yield device._asdict() | {"filter": kind} | _given_back(device, kind) | cost


def jobs(quick: bool, found: dict[str, Any]) -> Iterator[Job]:
    """One for the ticks' cost, then one for each rate and delay; to be run in this order.

    A row's `energy` is the mean over the phases of what a contact adds, of that before it.
    `found` gets the design, yardstick_ns, and a row for each rate, delay, stiffness, prediction and filter. A row's
    restitution is null where `missed`: at some phase of the tick the arm did not come back.
    """
    rows: list[dict[str, Any]] = []
    found["design"] = {"m_kg": falling.M_KG, "r_in": falling.R_IN, "speed_m_per_s": falling.SPEED}
    found["rows"] = rows
    tried, filters = (QUICK, QUICK_FILTERS) if quick else (FULL, FILTERS)
    costs: list[Costs] = []

    def measure() -> None:
        costs.append(tick_costs(tried, filters))
        found["yardstick_ns"] = {CHAIN: costs[0].chain_ns}

    def fall(cases: list[Case]) -> None:
        rows.extend(_rows(cases, filters, costs[0]))

    yield Job("servo: ticks", measure)
    for (rate_hz, delay), alike in groupby(tried, key=lambda case: case[:2]):
        yield Job(f"servo: falls at {rate_hz} Hz, {delay} ticks of delay", partial(fall, list(alike)))
