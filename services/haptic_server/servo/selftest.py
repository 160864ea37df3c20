"""python -m haptic_server.servo.selftest: is this machine fit for the force loop? Ten seconds of it, and JSON.

The very tick that plays, at the scene's rate, on a thread with everything the servo asks of the system; beside it the
probes, so that the host's own stalls can be told from ours.
"""

import argparse
import json
import sys
import threading
import time
from typing import Any, NamedTuple

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block
from haptic_server.servo import loop, priority
from haptic_server.servo.force import memory
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.loop import WARM_TICKS, Log, Times
from haptic_server.servo.stall_detector import StallDetector, without_host_stalls

# The promise: discounted by what probes saw, at 1 kHz with SCHED_FIFO.
P9999_NS, WORST_NS = 300_000, 500_000
_START_NS = 10_000_000  # what a thread may take to start
_PERCENTILES = (50.0, 99.0, 99.9, 99.99, 100.0)


class Played(NamedTuple):
    """Result of a run of the loop: `log` without the first ticks, and what the system granted its thread."""

    log: Log
    granted: dict[str, str]


def play(servo: Servo, ticks: int, cpu: int, first_ns: int) -> Played:
    """The very loop that plays, for `ticks` ticks on a thread of its own, as the servo's; blocks until it has ended.

    `first_ns`: when its first tick is due, by the monotonic clock. Control thread; `warm_up` before.
    """
    log = _log_of(ticks + WARM_TICKS)
    granted: dict[str, str] = {}
    made: list[int] = []

    def run() -> None:
        granted.update(priority.claim(cpu))
        made.append(loop.run_paced(servo, log, first_ns, ticks + WARM_TICKS))

    thread = threading.Thread(target=run, name="servo")
    thread.start()
    thread.join()
    return Played(Log(*(kept[WARM_TICKS : made[0]] for kept in log)), granted)


def _log_of(ticks: int) -> Log:
    due, late, spent = (np.zeros(ticks, np.int64) for _ in range(3))
    return Log(due, late, spent)


def _percentiles(values: Times) -> dict[str, float]:
    return {f"p{p:g}_us": float(np.percentile(values, p)) / 1e3 for p in _PERCENTILES}


def run(scene: Scene, seconds: float) -> dict[str, Any]:
    """Percentiles of lateness, with and without the stalls that probes saw, of a tick's duration, and the verdict."""
    loop.warm_up(memory.prepare(scene, block.in_memory(law_of(scene))))
    servo = memory.prepare(scene, block.in_memory(law_of(scene)))
    ticks = round(seconds * scene.servo.rate_Hz)
    with StallDetector() as detector:
        begin_ns = time.monotonic_ns() + _START_NS
        (due, late, spent), granted = play(servo, ticks, scene.servo.cpu, begin_ns)
    stalls = detector.stalls()
    ours = without_host_stalls(due, late, stalls)
    fifo = granted.get("scheduler", "").startswith("SCHED_FIFO")
    fit = fifo and float(np.percentile(ours, 99.99)) <= P9999_NS and int(ours.max()) <= WORST_NS
    return {
        "scene": scene.name,
        "rate_Hz": scene.servo.rate_Hz,
        "ticks": len(due),
        "granted": granted,
        "lateness": _percentiles(late),
        "lateness_without_host_stalls": _percentiles(ours),
        "tick": _percentiles(spent),
        "host_stalls": len(stalls),
        "longest_host_stall_us": float((stalls[:, 1] - stalls[:, 0]).max(initial=0)) / 1e3,
        "witnesses_refused": detector.refused,
        "fit": bool(fit),
    }


def main() -> int:
    """Run and print one JSON object."""
    arguments = argparse.ArgumentParser(prog="haptic_server.servo.selftest", description=__doc__)
    arguments.add_argument("--seconds", type=float, default=10.0)
    arguments.add_argument("--scene-text", help="TOML; the shipped scene roll without it")
    given = arguments.parse_args()
    text = given.scene_text if given.scene_text is not None else shipped_text("roll")
    print(json.dumps(run(parse(text, "scene"), given.seconds)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
