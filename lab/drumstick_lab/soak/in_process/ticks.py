"""The very tick that plays, run as fast as the machine computes, on a clock that is only counted: no time passes."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.records import EVENT, RELEASE, STRIKE
from haptic_server.servo import loop
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory
from realtime import ring

SECOND_NS = 10**9
# Set A with an exit pulse of 0.2 m/s and 2 ms: the reference's cycle, from 40 digits (limit_cycles.csv, A_stick_X).
ROLL_HZ = np.longdouble("23.05327091884809")
SETTLED_STRIKES = 400

Events = npt.NDArray[np.void]


class Astray(Exception):
    """A fault that a long run must never have; the text says which."""


class Counted(NamedTuple):
    """First values of a run's counters, as if it had come so far already."""

    ticks: int = 0
    strikes: int = 0


def servo_of(scene: Scene, folder: Path | None = None) -> memory.Servo:
    """A servo of the scene on its simulated device; its block in memory of its own, or a file that a gateway finds."""
    law = law_of(scene)
    block = blocks.in_memory(law) if folder is None else blocks.create(folder, law)
    device = Simulated(scene)
    return device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))


def begin_at(servo: memory.Servo, counted: Counted) -> None:
    """Put the counters there: ticks, strikes, and what went through the ring."""
    servo.status["tick"] = servo.tick_state["traced"] = counted.ticks
    servo.tick_state["seq"] = counted.strikes
    servo.block.ring_cells[[ring.WRITTEN, ring.READ]] = 2 * counted.strikes


def run(servo: memory.Servo, ticks: int, now_ns: int) -> int:
    """So many ticks after `now_ns`; the time of the last one."""
    return loop.run_virtual(servo, ticks, now_ns)


def taken(servo: memory.Servo, out: Events) -> Events:
    """The events since the last call, as a gateway takes them; a view of `out`."""
    return out[: ring.drain(servo.block.ring_cells, servo.block.events, out)]


def strikes_of(events: Events, after: int) -> Events:
    """The strikes among them. Raises Astray unless they go on from number `after`, each with its release, in order."""
    strikes = events[events["kind"] == STRIKE]
    if not np.all((events["kind"] == STRIKE) | (events["kind"] == RELEASE)):
        raise Astray(f"events of the kinds {np.unique(events['kind'])}")
    if not np.array_equal(strikes["seq"], after + 1 + np.arange(len(strikes))):
        raise Astray(f"a strike lost or twice after number {after}")
    if np.any(np.diff(events["kind"]) == 0):
        raise Astray(f"a strike without its release after number {after}")
    if np.any(np.diff(events["t_ns"]) <= 0):
        raise Astray(f"events out of order after number {after}")
    return strikes


def room() -> Events:
    """Memory into which events are taken: as many as the ring holds."""
    return np.zeros(blocks.RING_SLOTS, EVENT)


class Comb:
    """Instants of the strikes of a steady cycle of `rate_Hz`, counted from one strike once it has settled."""

    def __init__(self, rate_Hz: np.longdouble, settled: int = SETTLED_STRIKES) -> None:
        self._rate_Hz = rate_Hz
        self._settled = settled
        self._seen = 0
        self.origin: tuple[int, int] | None = None  # number and ns
        self.since_ns = 0.0  # from the origin to the newest

    def residuals_ns(
        self, numbers: npt.NDArray[np.int64], t_ns: npt.NDArray[np.int64]
    ) -> npt.NDArray[np.float64]:
        """Distances of strikes, shape (n,), from their instants; none before it has settled."""
        self._seen += len(numbers)
        if self.origin is None and self._seen >= self._settled and len(numbers):
            self.origin = (int(numbers[-1]), int(t_ns[-1]))
        if self.origin is None or not len(numbers):
            return np.zeros(0)
        later = numbers >= self.origin[0]
        since = (numbers[later] - self.origin[0]).astype(np.longdouble) / self._rate_Hz * SECOND_NS
        self.since_ns = float(since[-1]) if len(since) else self.since_ns
        return ((t_ns[later] - self.origin[1]).astype(np.longdouble) - since).astype(float)
