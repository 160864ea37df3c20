"""Time of a start, and until a killed service is back: drumstick lab start-and-restart [--runs 5].

Baselines from the same run: starting Python, and importing numba and zenoh in it; ratios are to those. `--help` is
timed beside `python -c pass`. "Back" means: the sound server has played a strike again, the panel accepts
connections, the gateway's state is heard again, a restarted servo strikes again. Kernels are cached beforehand.
"""

import argparse
import os
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

from rig_process import DRUMSTICK, Listener, Rig, running, wait_for

from drumstick_lab.measuring import stored
from protocol.messages import Meter, State
from rig.network.ports import listens


def timed(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def spread(values: list[float]) -> dict[str, float]:
    return {"min": min(values), "median": statistics.median(values), "max": max(values), "runs": len(values)}


def commands(runs: int) -> dict[str, list[float]]:
    """Time whole processes, interleaved."""
    shown: dict[str, list[str]] = {
        "python": [sys.executable, "-c", "pass"],
        "imports": [sys.executable, "-c", "import numba, zenoh"],
        "help": [*DRUMSTICK, "--help"],
    }
    seconds: dict[str, list[float]] = {name: [] for name in shown}
    for _ in range(runs):
        for name, command in shown.items():
            seconds[name].append(timed(lambda c=command: subprocess.run(c, capture_output=True, check=True)))
    return seconds


def kill(rig: Rig, module: str) -> None:
    os.kill(rig.children()[module], signal.SIGKILL)


def restarts(rig: Rig, runs: int) -> dict[str, list[float]]:
    session = rig.client()
    meters = Listener(session, rig.keys.meter, Meter)
    states = Listener(session, rig.keys.state, State)
    wait_for("the rig", lambda: meters.got and listens("127.0.0.1", rig.panel_port))
    seconds: dict[str, list[float]] = {"sound": [], "panel": [], "gateway": [], "servo": []}

    def sound() -> None:
        old = meters.got[-1].id
        kill(rig, "sound_server")
        wait_for("sound", lambda: meters.got[-1].id != old and meters.got[-1].played > 0)

    def panel() -> None:
        kill(rig, "web_panel")
        wait_for("its end", lambda: not listens("127.0.0.1", rig.panel_port))
        wait_for("the panel", lambda: listens("127.0.0.1", rig.panel_port))

    def gateway() -> None:
        old = rig.children()["haptic_server.gateway"]
        kill(rig, "haptic_server.gateway")
        wait_for("another process", lambda: rig.children().get("haptic_server.gateway", old) != old)
        heard = len(states.got)
        wait_for("state", lambda: len(states.got) > heard + 1)

    def servo() -> None:
        old = states.got[-1].boot
        kill(rig, "haptic_server.servo")
        wait_for("strikes", lambda: states.got[-1].boot != old and states.got[-1].strikes > 0)

    for _ in range(runs):
        for name, work in (("sound", sound), ("panel", panel), ("gateway", gateway), ("servo", servo)):
            seconds[name].append(timed(work))
            wait_for("all four", lambda: len(rig.children()) == 4 and meters.got[-1].played > 0)
            time.sleep(
                10.5
            )  # a service that dies again within ten seconds is restarted more slowly, on purpose
    session.close()
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    with running("up", "--duration", "1") as warm:
        warm.process.wait(180)
    seconds = commands(runs)
    with running("up") as rig:
        seconds.update({f"back: {name}": values for name, values in restarts(rig, runs).items()})
    baseline = statistics.median(seconds["imports"])
    bare = statistics.median(seconds["python"])
    rows: dict[str, Any] = {
        name: {**spread(values), "to_python": statistics.median(values) / bare}
        | {"to_imports": statistics.median(values) / baseline}
        for name, values in seconds.items()
    }
    result = {"unit": "s", "rows": rows}
    stored.store("start_and_restart", result)
    for name, row in rows.items():
        print(f"{name:16s} median {row['median']:.3f} s (min {row['min']:.3f}, max {row['max']:.3f})")


if __name__ == "__main__":
    main()
