"""Lateness of the force loop, beside an equal loop in C: drumstick lab lateness [--window-s 5] [--scene roll].

Ours is the servo process with its own loop (lateness_servo.py); the other is lateness_loop.c, built with the system's
compiler: the same rate, priority, locked memory, timer slack, processor and spin. Both run at the same time, so that
load, host and kernel are the same for both, half a period apart, so that neither is in the other's way: each is done
with its tick long before the other wakes. They swap phases from window to window, because the kernel's own timer tick
falls on one phase. Probes (servo/stall_detector.py), here in a third process, see the host's stalls, which are discounted
from both alike. The condition `two C loops` shows how far two equal loops differ here: the noise of every ratio.

Conditions: idle; a thread of pure Python in the servo's own process; as many busy processes as processors; sets of
parameters by Zenoh through the real gateway, and whole sets straight into the servo's block as the gateway puts them
there; OSC to the gateway's real port. The floods report what rate they really reached.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.benchmarks.force_loop.lateness_loads import Flood, Gateway, busy_processes
from drumstick_lab.benchmarks.force_loop.lateness_pair import (
    CLoop,
    Loop,
    ServoLoop,
    Window,
    built,
    compared,
    percentiles,
    window,
)
from drumstick_lab.measuring import stored
from haptic_server import files

WINDOWS = 4
SETS_PER_S, OSC_PER_S = 10_000, 50_000
RATIO_AT_MOST, P9999_US = 1.2, 300.0
_GATEWAY_STARTS_S = 120.0  # it may have to compile


class Bench(NamedTuple):
    """Fixture of every condition: the scene, the loop in C, ticks in a window."""

    scene: Scene
    program: Path
    ticks: int

    def windows(self, ours: Loop, other: Loop) -> list[Window]:
        rate = self.scene.servo.rate_Hz
        return [window(ours, other, rate, self.ticks, bool(i % 2)) for i in range(WINDOWS)]


def _c_and_c(bench: Bench, folder: Path) -> dict[str, Any]:
    return compared(
        bench.windows(CLoop(bench.program, bench.scene, "one"), CLoop(bench.program, bench.scene))
    )


def _with_servo(bench: Bench, ours: ServoLoop) -> dict[str, Any]:
    other = CLoop(bench.program, bench.scene)
    found = compared(bench.windows(ours, other))
    # The newest: a gateway starts in a window of its own, before these.
    ended, seconds = ours.ended[-WINDOWS:], WINDOWS * bench.ticks / bench.scene.servo.rate_Hz
    return found | {
        "tick": percentiles(np.concatenate(ours.spent_ns[-WINDOWS:])),
        "strikes": sum(each["seq"] for each in ended),
        "sets_that_reached_the_servo_per_s": sum(each["revision"] for each in ended) / seconds,
        "refused_by_the_servo": sum(each["refused"] for each in ended),
        "fault": ended[-1]["fault"],
        "granted": {"ours": ours.granted, "c": other.granted},
    }


def _idle(bench: Bench, folder: Path) -> dict[str, Any]:
    with closing(ServoLoop(folder)) as ours:
        return _with_servo(bench, ours)


def _busy_interpreter(bench: Bench, folder: Path) -> dict[str, Any]:
    with closing(ServoLoop(folder, busy=True)) as ours:
        return _with_servo(bench, ours)


def _full(bench: Bench, folder: Path) -> dict[str, Any]:
    with closing(ServoLoop(folder)) as ours, busy_processes(os.cpu_count() or 1):
        return _with_servo(bench, ours)


def _block_flood(bench: Bench, folder: Path) -> dict[str, Any]:
    with (
        closing(ServoLoop(folder)) as ours,
        closing(Flood("block", str(folder), "--rate", str(SETS_PER_S))) as flood,
    ):
        found = _with_servo(bench, ours)
        return found | {"flood": flood.end()}


def _through_gateway(
    bench: Bench, folder: Path, given: Callable[[Gateway], tuple[str, ...]]
) -> dict[str, Any]:
    with closing(ServoLoop(folder)) as ours, closing(Gateway(folder)) as gateway:
        deadline = time.monotonic() + _GATEWAY_STARTS_S
        answered = False
        while not answered:  # it waits for a servo that ticks: so this one does, meanwhile
            ours.start(time.monotonic_ns(), bench.scene.servo.rate_Hz)
            answered = gateway.answers()
            ours.kept()
            if not answered and time.monotonic() > deadline:
                raise RuntimeError(f"the gateway did not start within {_GATEWAY_STARTS_S:.0f} s")
        with closing(Flood(*given(gateway))) as flood:
            found = _with_servo(bench, ours)
            found["flood"] = flood.end()
        return found | {"osc_counted": gateway.counters()}


def _zenoh_flood(bench: Bench, folder: Path) -> dict[str, Any]:
    return _through_gateway(
        bench, folder, lambda it: ("zenoh", it.endpoint, it.rig, "--rate", str(SETS_PER_S))
    )


def _osc_flood(bench: Bench, folder: Path) -> dict[str, Any]:
    return _through_gateway(bench, folder, lambda it: ("osc", str(it.osc_port), "--rate", str(OSC_PER_S)))


CONDITIONS: dict[str, Callable[[Bench, Path], dict[str, Any]]] = {
    "two C loops": _c_and_c,
    "idle": _idle,
    "busy interpreter": _busy_interpreter,
    "full CPU": _full,
    "sets over Zenoh": _zenoh_flood,
    "sets into the block": _block_flood,
    "OSC": _osc_flood,
}


def _verdict(row: dict[str, Any]) -> dict[str, bool]:
    return {
        "ratios": max(row["ratio"]["p50"], row["ratio"]["p99"]) <= RATIO_AT_MOST,
        "p99.99": row["ours"]["discounted"]["p99.99_us"] <= P9999_US,
    }


def measured(scene_text: str, window_s: float, names: list[str]) -> dict[str, Any]:
    """Every condition in a run folder of its own, in memory where the machine has that."""
    scene = parse(scene_text, "scene")
    rows: dict[str, Any] = {}
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as top:
        bench = Bench(scene, built(Path(top)), round(window_s * scene.servo.rate_Hz))
        for name in names:
            folder = Path(top) / name.replace(" ", "-")
            folder.mkdir()
            (folder / files.SCENE).write_text(scene_text, encoding="utf-8")
            load = os.getloadavg()[0]
            row = CONDITIONS[name](bench, folder)
            rows[name] = row | {"load_before": load, "kept": _verdict(row)}
            _show(name, rows[name])
    return {
        "scene": scene.name,
        "rate_Hz": scene.servo.rate_Hz,
        "window_s": window_s,
        "windows": WINDOWS,
        "rows": rows,
    }


def _show(name: str, row: dict[str, Any]) -> None:
    print(
        f"{name}: ours/C p50 {row['ratio']['p50']:.2f}, p99 {row['ratio']['p99']:.2f}; load {row['load_before']:.1f}"
    )
    for who in ("ours", "c"):
        for how in ("lateness", "discounted"):
            cells = "".join(f"{value:10.1f}" for value in row[who][how].values())
            print(f"  {who:5s}{how:11s}{cells}")
    if "flood" in row:
        print(f"  flood {row['flood']}; to the servo {row['sets_that_reached_the_servo_per_s']:.0f} a second")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--window-s", type=float, default=5.0)
    parser.add_argument("--scene", default="roll")
    parser.add_argument("--only", nargs="*", choices=CONDITIONS, help="these conditions; nothing is stored")
    given = parser.parse_args()
    found = measured(shipped_text(given.scene), given.window_s, given.only or list(CONDITIONS))
    if not given.only:
        stored.store("lateness", found)


if __name__ == "__main__":
    main()
