"""A hundred thousand junctions live: drumstick lab audio-live [--windows 5] [--seconds 5] [--priority 70].

A struck drum of that size, whose scene asks for two threads, on a device that keeps time (JACK's dummy driver, 256
frames at 48 kHz), through the sound server's own sink, while the interpreter is idle and while a thread of the same
process sorts in pure Python: how long the callback takes, as a share of the period; how often it came more than half a
period late; what the device counted as xruns. Windows of some seconds by turns; all are shown, and the quietest of each
is told. In the same seconds real-time threads that only sleep (haptic_server.servo.stall_detector) note when the machine
itself stood still: `excused` is without that; and the system tells how long the callback's thread waited while others
ran. `alone`: what the same blocks take offline on one thread. Run it on a machine that does nothing else. With a
priority above 0 JACK drops a client that is far too slow.
"""

import argparse
import random
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.scenes.scene_text import parse
from drumstick_lab.benchmarks.sound.bare_mesh import timed
from drumstick_lab.benchmarks.sound.jack_device import RATE_HZ, dummy_device
from drumstick_lab.measuring import stored
from haptic_server.servo.stall_detector import SELDOM_NS, StallDetector, without_host_stalls
from sound_server.second_thread import PRIORITY
from sound_server.sinks.selection import named_device

if TYPE_CHECKING:  # it loads PortAudio, which must find the JACK server running
    from sound_server.sinks.device import DeviceSink

BLOCK = 256
PERIOD_NS = round(BLOCK / RATE_HZ * 1e9)
JUNCTIONS = 100_000
# 335 across, 0.625 times 48 kHz over f01: a step of the mesh for every sample.
SCENE = parse(
    """
    name = "large"
    [drum]
    f01_Hz = 89.5
    t60_s = 4.0
    [mesh]
    junctions_across = 335.0
    cpu_budget = 0.9
    threads = 2
    """,
    __file__,
)
STRIKES_EVERY_S = 0.25
GOAL = 0.8
MAX_S = 20.0
Numbers = npt.NDArray[np.int64]


def large(ring: StrikeRing) -> Engine:
    engine = build(SCENE, RATE_HZ, ring)
    junctions = int(np.count_nonzero(engine.head.weights))
    assert engine.control["divisor"][0] == 1, engine.control["divisor"]
    assert junctions >= JUNCTIONS, junctions
    return engine


def alone() -> float:
    """Share of the period that the callback would take without the second thread, offline: the median of 40 blocks."""
    ring = StrikeRing()
    engine, out = large(ring), np.zeros((BLOCK, 2), np.float32)
    blow = strike_for_speed(SCENE, 1.0, 0.5, 0.0)
    assert ring.push(0, blow.x, blow.y, blow.peak_N, blow.contact_s)
    spent = [timed(lambda: render_all(engine, out, BLOCK, 0)) for _ in range(40)]
    return float(np.median(spent)) * 1e9 / PERIOD_NS


def sorting(stop: threading.Event) -> None:
    numbers = list(range(20_000))
    while not stop.is_set():
        random.shuffle(numbers)
        numbers.sort()


def idle(stop: threading.Event) -> None:
    stop.wait()


Work = Callable[[threading.Event], None]


def scheduled() -> dict[int, Numbers]:
    """Times of every thread of this process that is not Python's: ns it ran, ns it was ready and had to wait for others."""
    ours = {thread.native_id for thread in threading.enumerate()}
    tasks = [task for task in Path("/proc/self/task").iterdir() if int(task.name) not in ours]
    return {
        int(task.name): np.array((task / "schedstat").read_text().split()[:2], np.int64) for task in tasks
    }


def callback_shares(
    before: dict[int, Numbers], after: dict[int, Numbers], blocks: int
) -> tuple[float, float]:
    """Shares of the period, on average: the callback's own time on a processor, and its waiting for one."""
    spent = [after[task] - before[task] for task in after if task in before]
    ran, waited = max(spent, key=lambda times: int(times[0]))  # the callback's thread computes most of all
    return float(ran) / blocks / PERIOD_NS, float(waited) / blocks / PERIOD_NS


def window(sink: "DeviceSink", ring: StrikeRing, seconds: float, work: Work) -> Any:
    """Blocks, stalls and xruns of some seconds with `work` on a thread of its own."""
    stop = threading.Event()
    worker = threading.Thread(target=work, args=(stop,), daemon=True)
    blow = strike_for_speed(SCENE, 1.0, 0.5, 0.0)
    before, xruns = time.monotonic_ns(), sink.xruns
    with StallDetector(SELDOM_NS) as probes:
        worker.start()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            assert ring.push(0, blow.x, blow.y, blow.peak_N, blow.contact_s)
            time.sleep(STRIKES_EVERY_S)
        found = sink.blocks
        stop.set()
        worker.join()
    assert not sink.lost, sink.lost
    return found[found[:, 0] >= before], probes, sink.xruns - xruns


def shares(spent: Numbers) -> dict[str, float]:
    """Percentiles, as shares of the period."""
    named = {"p50": 50.0, "p90": 90.0, "p99": 99.0, "p99.9": 99.9, "max": 100.0}
    return {name: float(np.percentile(spent, at)) / PERIOD_NS for name, at in named.items()}


def row(sink: "DeviceSink", ring: StrikeRing, seconds: float, work: Work) -> Any:
    times = scheduled()
    blocks, probes, xruns = window(sink, ring, seconds, work)
    ran, waited = callback_shares(times, scheduled(), len(blocks))
    begun, spent, stalls = blocks[:, 0], blocks[:, 1], probes.stalls()
    # A block is due a period after the one before; a late one does not make the next late.
    late = np.maximum(np.diff(begun) - PERIOD_NS, 0)
    without = without_host_stalls(begun[:-1] + PERIOD_NS, late, stalls)
    stalled = stalls[:, 1] - stalls[:, 0]
    return {
        "blocks": len(blocks),
        "share": shares(spent),
        "ran_mean": ran,
        "waited_mean": waited,
        "share_excused": shares(without_host_stalls(begun, spent, stalls)),
        "late": int(np.sum(late > PERIOD_NS // 2)),
        "late_excused": int(np.sum(without > PERIOD_NS // 2)),
        "xruns": xruns,
        "witnessed_stalls_over_1_ms": int(np.sum(stalled > 1_000_000)),
        "longest_stall_ms": float(stalled.max(initial=0)) * 1e-6,
        "witnesses_refused": probes.refused,
    }


def show(name: str, found: dict[str, Any]) -> None:
    share = ", ".join(f"{at} {value:.1%}" for at, value in found["share"].items())
    print(f"{name:8s} {found['blocks']} blocks, share of the period: {share}")
    print(
        f"         excused: p99 {found['share_excused']['p99']:.1%}, max {found['share_excused']['max']:.1%};"
        f" on average it ran {found['ran_mean']:.1%} and waited for a processor {found['waited_mean']:.1%}"
    )
    print(
        f"         late {found['late']} ({found['late_excused']} without stalls), xruns {found['xruns']}, stalls over"
        f" 1 ms {found['witnessed_stalls_over_1_ms']}, longest {found['longest_stall_ms']:.1f} ms"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--windows", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument(
        "--priority", type=int, default=PRIORITY, help="of the audio threads: 0, or SCHED_FIFO's"
    )
    options = parser.parse_args()
    if not 1.0 <= options.seconds <= MAX_S:
        parser.error(f"--seconds {options.seconds:g}: 1 .. {MAX_S:g}, what the sink remembers of its blocks")
    by_one = alone()
    with dummy_device(BLOCK, options.priority) as name:
        from sound_server.sinks.device import DeviceSink

        sink = named_device(name, RATE_HZ, BLOCK)
        assert isinstance(sink, DeviceSink)
        ring = StrikeRing()
        engine = large(ring)
        sink.mixer.make_ready(engine)
        sink.mixer.enter(engine)
        found: dict[str, list[dict[str, Any]]] = {work.__name__: [] for work in (idle, sorting)}
        for _ in range(options.windows):
            for work in (idle, sorting):
                found[work.__name__].append(row(sink, ring, options.seconds, work))
                show(work.__name__, found[work.__name__][-1])
        peak = float(engine.meters["peak_left"][0])
        sink.close()
    assert peak > 1e-3, f"it does not ring: {peak}"
    rows = {name: min(windows, key=lambda window: window["share"]["p99"]) for name, windows in found.items()}
    print(f"one thread, offline: {by_one:.1%} of the period; the quietest of two threads, live:")
    for name, quietest in rows.items():
        show(name, quietest)
        if quietest["share"]["p99"] > GOAL:
            print(f"         above the goal: p99 {GOAL:.0%}")
    result = {
        "junctions": int(np.count_nonzero(engine.head.weights)),
        "block": BLOCK,
        "rate_Hz": RATE_HZ,
        "priority": options.priority,
        "threads": SCENE.mesh.threads,
        "alone": by_one,
        "rows": rows,
        "p99_of_all_windows": {
            name: [window["share"]["p99"] for window in windows] for name, windows in found.items()
        },
    }
    stored.store("audio_live", result)


if __name__ == "__main__":
    main()
