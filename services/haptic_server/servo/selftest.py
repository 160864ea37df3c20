"""python -m haptic_server.servo.selftest: is this machine fit for the force loop? Ten seconds of it, and JSON.

The very tick that plays, at the scene's rate, on a thread with everything the servo asks of the system; beside it the
witnesses, so that the host's own stalls can be told from ours.
"""

import argparse
import json
import sys
import threading
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.law import law_of
from drumstick.scene import Scene, parse, shipped_text
from haptic_server import block
from haptic_server.servo import loop, memory, priority
from haptic_server.servo.memory import Servo
from haptic_server.servo.telling import tell
from haptic_server.servo.witness import Witnesses, excused
from realtime.clock import now_ns, wait_until
from realtime.jit import njit

# The promise: discounted by what witnesses saw, at 1 kHz with SCHED_FIFO.
P9999_NS, WORST_NS = 300_000, 500_000
_WARM_TICKS = 100
_PERCENTILES = (50.0, 99.0, 99.9, 99.99, 100.0)

Times = npt.NDArray[np.int64]


@njit()
def paced(servo: Servo, due: Times, late: Times, spent: Times) -> None:
    """As loop.run_paced for len(due) ticks; keeps when each was due, how late it came, how long it took, ns."""
    period = servo.plan[0].period_ns
    deadline = now_ns(servo.timespec) + period
    span = period
    spin = servo.plan[0].spin_ns
    for tick in range(due.shape[0]):
        wait_until(servo.timespec, deadline, spin)
        woken = now_ns(servo.timespec)
        due[tick] = deadline
        late[tick] = woken - deadline
        loop.traced_tick(servo, deadline, span * 1e-9)
        tell(servo, deadline)
        ended = now_ns(servo.timespec)
        spent[tick] = ended - woken
        span = (max(ended - deadline, 0) // period + 1) * period
        deadline += span


def _percentiles(values: Times) -> dict[str, float]:
    return {f"p{p:g}_us": float(np.percentile(values, p)) / 1e3 for p in _PERCENTILES}


def run(scene: Scene, seconds: float) -> dict[str, Any]:
    """Percentiles of lateness, with and without what witnesses excuse, of a tick's duration, and the verdict."""
    ticks = round(seconds * scene.servo.rate_Hz) + _WARM_TICKS
    servo = memory.prepare(scene, block.in_memory(law_of(scene)))
    loop.run_virtual(servo, 200, 0)
    due, late, spent = (np.zeros(ticks, np.int64) for _ in range(3))
    paced(servo, due[:2], late[:2], spent[:2])
    granted: dict[str, str] = {}

    def play() -> None:
        granted.update(priority.claim(scene.servo.cpu))
        paced(servo, due, late, spent)

    with Witnesses() as witnesses:
        thread = threading.Thread(target=play, name="servo")
        thread.start()
        thread.join()
    due, late, spent = due[_WARM_TICKS:], late[_WARM_TICKS:], spent[_WARM_TICKS:]
    stalls = witnesses.stalls()
    ours = excused(due, late, stalls)
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
        "witnesses_refused": witnesses.refused,
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
