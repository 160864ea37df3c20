"""Cost of the gateway's wait and delay of a strike in it: drumstick lab gateway-share [--turns 3] [--quick].

A stand-in servo ticks at 1 kHz into a real block: a stick that lies in the head, one that is swung above it, a roll at
23 Hz, and strikes of a stick that was held still, which nothing announced. Two real gateways take turns, each with a
servo and listeners of its own: one as it is, one that looks every 150 us as it did before. Share of a core and wake-ups
a second by the system's own count, of all threads; microseconds from the tick to an OSC port, to a Zenoh subscriber
and, by a bare datagram of the servo itself, to a third listener.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick_lab.benchmarks.gateway.moving_servo import MOTIONS, RATE_HZ
from drumstick_lab.benchmarks.network.wire import Times, child, line
from drumstick_lab.measuring import stored
from haptic_server.gateway.options import GatewayOptions
from haptic_server.servo.stall_detector import StallDetector, without_host_stalls
from ports import free_port
from realtime.service_options import command

SHARE_GOAL, ABOVE_BARE_GOAL_US = 0.25, 350.0
WAYS = {"foreseen": "haptic_server.gateway", "steady": "drumstick_lab.benchmarks.gateway.steady_gateway"}
LISTENER = "drumstick_lab.benchmarks.network.wire_listener"
SECONDS = {"lying": 5.0, "swung": 5.0, "rolling": 10.0, "unforeseen": 10.0}
STRUCK = ("rolling", "unforeseen")
KINDS = ("bare", "osc", "zenoh")


class Use(NamedTuple):
    """Processor time and voluntary context switches of a process since it began."""

    ns: int
    wakes: int


class Phase(NamedTuple):
    """One motion of one turn: share of a core, wake-ups a second, numbers of the first and the last strike."""

    share: float
    wakes_per_s: float
    first: int
    last: int


def use_of(pid: int) -> Use:
    """Use of all threads together. Linux."""
    ns = wakes = 0
    for task in Path(f"/proc/{pid}/task").iterdir():
        ns += int((task / "schedstat").read_text().split()[0])
        words = (task / "status").read_text().split()
        wakes += int(words[words.index("voluntary_ctxt_switches:") + 1])
    return Use(ns, wakes)


class Side:
    """A servo, its gateway and who listens to it."""

    def __init__(self, open_ones: ExitStack, way: str) -> None:
        self._folder = Path(open_ones.enter_context(tempfile.TemporaryDirectory()))
        router = f"tcp/127.0.0.1:{free_port()}"
        osc, bare, osc_in = (free_port() for _ in range(3))
        self._ports = {"zenoh": (router, "1"), "bare": (str(bare),), "osc": (str(osc),)}
        script = "drumstick_lab.benchmarks.gateway.moving_servo"
        self._listeners = ExitStack()
        self._servo = self._listeners.enter_context(child(script, str(self._folder), str(bare)))
        while not (self._folder / "servo.block").exists():
            time.sleep(0.05)
        options = GatewayOptions(
            run_dir=self._folder, state_dir=self._folder / "state", rig="wire", listen=router,
            osc_in=("127.0.0.1", osc_in), osc_out=(("127.0.0.1", osc),),
        )  # fmt: skip
        self._gateway = open_ones.enter_context(running(command(WAYS[way], options)))
        open_ones.enter_context(self._listeners)
        for kind in KINDS:
            words = (str(self._folder / f"{kind}.npz"), kind, *self._ports[kind])
            assert line(self._listeners.enter_context(child(LISTENER, *words))) == "ready\n"

    def play(self, motion: str, seconds: float) -> Phase:
        """One phase."""
        assert self._servo.stdin is not None
        before, began = use_of(self._gateway.pid), time.monotonic()
        self._servo.stdin.write(f"{motion} {seconds}\n")
        self._servo.stdin.flush()
        first, last = map(int, line(self._servo).split())
        took_s = time.monotonic() - began
        after = use_of(self._gateway.pid)
        return Phase(
            (after.ns - before.ns) / took_s * 1e-9, (after.wakes - before.wakes) / took_s, first, last
        )

    def ended(self) -> tuple[Times, dict[str, Times]]:
        """Ticks of all strikes, and when each listener heard which; ends the servo and them."""
        time.sleep(0.5)  # what is under way arrives
        self._listeners.close()
        heard: dict[str, Times] = {}
        for kind in KINDS:
            with np.load(self._folder / f"{kind}.npz") as arrays:
                heard[kind] = arrays["0"]
        return np.load(self._folder / "ticks.npy"), heard


@contextmanager
def running(words: list[str]) -> Iterator["subprocess.Popen[bytes]"]:
    """The process of these words; it is terminated at the end."""
    process = subprocess.Popen(words)
    try:
        yield process
    finally:
        process.terminate()
        process.wait(30)


def waits_us(numbers: Times, ticks: Times, rows: Times, stalls: Times) -> npt.NDArray[np.float64]:
    """From the tick of each of these strikes to its listener, less what the host stood still; NaN: not heard."""
    waits = np.full(len(numbers), np.nan)
    _, at, of_rows = np.intersect1d(numbers, rows[:, 0], return_indices=True)
    struck = ticks[numbers[at] - 1]
    waits[at] = without_host_stalls(struck, rows[of_rows, 1] - struck, stalls) / 1e3
    return waits


def delays(phases: list[Phase], ticks: Times, heard: dict[str, Times], stalls: Times) -> dict[str, Any]:
    """Percentiles of the strikes of these phases, strike by strike above the bare datagram; not of the first ten."""
    numbers = np.concatenate([np.arange(phase.first + 10, phase.last + 1) for phase in phases])
    waits = {kind: waits_us(numbers, ticks, heard[kind], stalls) for kind in KINDS}
    p50, p99 = np.nanpercentile(waits["bare"], (50, 99))
    result: dict[str, Any] = {
        "strikes": len(numbers),
        "bare_p50_us": round(p50, 1),
        "bare_p99_us": round(p99, 1),
    }
    for kind in ("osc", "zenoh"):
        p50, p99 = np.nanpercentile(waits[kind] - waits["bare"], (50, 99))
        result[f"{kind}_above_bare_p50_us"], result[f"{kind}_above_bare_p99_us"] = (
            round(p50, 1),
            round(p99, 1),
        )
        result[f"{kind}_lost"] = int(np.isnan(waits[kind]).sum())
    return result


def measured(turns: int, seconds: dict[str, float]) -> dict[str, Any]:
    """Rows of each way: medians of the turns, percentiles of all strikes."""
    found: dict[str, dict[str, list[Phase]]] = {way: {motion: [] for motion in MOTIONS} for way in WAYS}
    with ExitStack() as open_ones:
        sides = {way: Side(open_ones, way) for way in WAYS}
        time.sleep(2.0)  # the gateways' own start
        with StallDetector() as probes:
            for _ in range(turns):
                for motion, lasts_s in seconds.items():
                    for way, side in sides.items():
                        found[way][motion].append(side.play(motion, lasts_s))
                        print(way, motion, found[way][motion][-1], flush=True)
        ends = {way: side.ended() for way, side in sides.items()}
        stalls = probes.stalls()
    rows: dict[str, Any] = {}
    for way, motions in found.items():
        rows[way] = {}
        for motion, phases in motions.items():
            row: dict[str, Any] = {
                "share": round(statistics.median(each.share for each in phases), 5),
                "wakes_per_s": round(statistics.median(each.wakes_per_s for each in phases), 1),
            }
            if motion in STRUCK:
                row |= delays(phases, *ends[way], stalls)
            rows[way][motion] = row
    return rows


def _judge(result: dict[str, Any]) -> None:
    # Say which goals are missed.
    for what in ("wakes_of_steady", "share_of_steady"):
        if result[what] > SHARE_GOAL:
            print(f"above the goal: {what} {result[what]:.2f}, not {SHARE_GOAL:.2f}")
    above_us = result["rows"]["foreseen"]["rolling"]["osc_above_bare_p50_us"]
    if above_us > ABOVE_BARE_GOAL_US:
        print(f"above the goal: OSC {above_us:.0f} us above a bare datagram, not {ABOVE_BARE_GOAL_US:.0f}")
    for way, rows in result["rows"].items():
        for motion, row in rows.items():
            lost = {name: count for name, count in row.items() if name.endswith("_lost") and count}
            if lost:
                print(f"{way}, {motion}: lost {lost}")


def main() -> None:
    """Measure and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument(
        "--quick", action="store_true", help="one turn of a third of the time; stores nothing"
    )
    given = parser.parse_args()
    seconds = {motion: lasts_s / 3.0 for motion, lasts_s in SECONDS.items()} if given.quick else SECONDS
    rows = measured(1 if given.quick else given.turns, seconds)
    print(json.dumps(rows, indent=1))
    lying = {way: rows[way]["lying"] for way in WAYS}
    result = {
        "turns": given.turns,
        "rate_Hz": RATE_HZ,
        "share_goal": SHARE_GOAL,
        "above_bare_goal_us": ABOVE_BARE_GOAL_US,
        "share_of_steady": lying["foreseen"]["share"] / lying["steady"]["share"],
        "wakes_of_steady": lying["foreseen"]["wakes_per_s"] / lying["steady"]["wakes_per_s"],
        "rows": rows,
    }
    _judge(result)
    if not given.quick:
        stored.store("gateway_share", result)


if __name__ == "__main__":
    main()
