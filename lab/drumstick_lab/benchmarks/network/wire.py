"""Delay that the gateway adds: drumstick lab wire [--quick]. Stores lab/results/wire.json.

A stand-in servo strikes at 1 kHz for a minute into a real block; the real gateway carries the strikes to an OSC port
and to a Zenoh subscriber; a bare datagram sent by the servo itself goes to a third listener. Each has a process of its
own. Microseconds from the tick to the listener, and what was lost. The same for a roll of 25 Hz. How soon telemetry is
back after a router's return. Then the ceiling: strikes a second to 1, 10 and 50 subscribers, doubled until some get
lost.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick_lab.benchmarks.network.wire_servo import WARM_S
from drumstick_lab.measuring import stored
from haptic_server.gateway.options import GatewayOptions
from haptic_server.servo.stall_detector import StallDetector, without_host_stalls
from ports import free_port
from realtime.service_options import command

GOAL_US = 350.0
SUBSCRIBERS = (1, 10, 50)
FIRST_HZ, LAST_HZ = 1000, 64_000
Times = npt.NDArray[np.int64]


class Run(NamedTuple):
    """One run: how many strikes were made, how many found the ring full, when each listener heard which."""

    made: int
    ring_dropped: int
    ticks: Times  # ns, of strike number 1 onwards
    heard: dict[str, list[Times]]
    stalls: Times


@contextmanager
def child(module: str, *words: str) -> Iterator["subprocess.Popen[str]"]:
    """A Python process that ends with its input, and whose lines can be read."""
    process = subprocess.Popen(
        [sys.executable, "-m", module, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        assert process.stdin is not None
        process.stdin.close()
        if process.wait(300) != 0:
            raise RuntimeError(f"{module} {words} ended with status {process.returncode}")


@contextmanager
def gateway(folder: Path, router: str, osc_in: int, osc_out: int) -> Iterator[None]:
    """The real one."""
    options = GatewayOptions(
        run_dir=folder, state_dir=folder / "state", rig="wire", listen=router, osc_in=("127.0.0.1", osc_in),
        osc_out=(("127.0.0.1", osc_out),),
    )  # fmt: skip
    process = subprocess.Popen(command("haptic_server.gateway", options))
    try:
        yield
    finally:
        process.terminate()
        process.wait(30)


def line(process: "subprocess.Popen[str]") -> str:
    """The next line that it prints."""
    assert process.stdout is not None
    return process.stdout.readline()


def strike(rate_Hz: float, seconds: float, subscribers: int) -> Run:
    """One run at this rate."""
    router = f"tcp/127.0.0.1:{free_port()}"
    osc, bare, osc_in = (free_port() for _ in range(3))
    kinds = {"zenoh": (router, str(subscribers)), "bare": (str(bare),), "osc": (str(osc),)}
    with ExitStack() as open_ones:
        folder = Path(open_ones.enter_context(tempfile.TemporaryDirectory()))
        script = "drumstick_lab.benchmarks.network.wire_servo"
        servo = open_ones.enter_context(child(script, str(folder), str(rate_Hz), str(seconds), str(bare)))
        while not (folder / "servo.block").exists():
            time.sleep(0.05)
        open_ones.enter_context(gateway(folder, router, osc_in, osc))
        with ExitStack() as listening:
            for kind, words in kinds.items():
                script = "drumstick_lab.benchmarks.network.wire_listener"
                listener = listening.enter_context(child(script, str(folder / f"{kind}.npz"), kind, *words))
                assert line(listener) == "ready\n"
            with StallDetector() as probes:
                assert servo.stdin is not None
                servo.stdin.write("go\n")
                servo.stdin.flush()
                made, dropped = map(int, line(servo).split())
        heard: dict[str, list[Times]] = {}
        for kind in kinds:
            with np.load(folder / f"{kind}.npz") as arrays:
                heard[kind] = [arrays[name] for name in arrays.files]
        ticks = np.load(folder / "ticks.npy")
    return Run(made, dropped, ticks, heard, probes.stalls())


def delays_us(run: Run, kind: str, first: int) -> npt.NDArray[np.float64]:
    """Delays from tick to listener, less what witnesses saw the machine stand still; strikes from number `first` on."""
    rows = run.heard[kind][0]
    rows = rows[rows[:, 0] >= first]
    ticks = run.ticks[rows[:, 0] - 1]
    return without_host_stalls(ticks, rows[:, 1] - ticks, run.stalls) / 1e3


def lost(run: Run, kind: str) -> int:
    """Strikes that some subscriber of this kind did not hear; twice heard would be an error."""
    counts = [len(np.unique(rows[:, 0])) for rows in run.heard[kind]]
    assert all(len(rows) == count for rows, count in zip(run.heard[kind], counts, strict=True))
    return sum(run.made - count for count in counts)


def latency(rate_Hz: float, seconds: float) -> dict[str, object]:
    """Percentiles for each listener; and how much more than the bare datagram."""
    run = strike(rate_Hz, seconds, 1)
    first = round(WARM_S * rate_Hz)
    result: dict[str, object] = {"rate_Hz": rate_Hz, "seconds": seconds, "strikes": run.made}
    bare = delays_us(run, "bare", first)
    for kind in ("bare", "osc", "zenoh"):
        delays = delays_us(run, kind, first)
        p50, p99 = np.percentile(delays, (50, 99))
        result[kind] = {"p50_us": round(p50, 1), "p99_us": round(p99, 1), "lost": lost(run, kind)}
        result[f"{kind}_above_bare_p50_us"] = round(p50 - float(np.median(bare)), 1)
    return result


def ceiling(subscribers: int, seconds: float) -> list[dict[str, object]]:
    """Rates doubled until something is lost on the way to the subscribers."""
    rows: list[dict[str, object]] = []
    rate = FIRST_HZ
    while rate <= LAST_HZ:
        run = strike(rate, seconds, subscribers)
        p50, p99 = np.percentile(delays_us(run, "zenoh", 1), (50, 99))
        share = lost(run, "zenoh") / (run.made * subscribers)
        rows.append(
            {
                "rate_Hz": rate,
                "lost_share": round(share, 4),
                "lost_osc_share": round(lost(run, "osc") / run.made, 4),
                "ring_dropped": run.ring_dropped,
                "p50_us": round(p50),
                "p99_us": round(p99),
            }
        )
        print(subscribers, rows[-1], flush=True)
        if share > 0.0 or run.ring_dropped:
            break
        rate *= 2
    return rows


def returns_s(runs: int) -> dict[str, float]:
    """A router of its own is killed, and its process started again after two seconds: from then until telemetry."""
    from lone_router import lone_router
    from rig_process import Listener, running, wait_for

    from protocol.messages import State
    from protocol.session import open_client

    took: list[float] = []
    with lone_router() as router, running("haptic", "--scene", "roll", "--connect", router.endpoint) as rig:
        session = open_client(router.endpoint, lambda: True)
        assert session is not None
        states = Listener(session, rig.keys.state, State)
        wait_for("telemetry", lambda: states.got)
        for _ in range(runs):
            router.kill()
            time.sleep(2.0)
            heard = len(states.got)
            begun = time.monotonic()
            router.start()
            wait_for("telemetry", lambda heard=heard: len(states.got) > heard)
            took.append(time.monotonic() - begun)
        session.close()
    return {"runs": runs, "median_s": round(float(np.median(took)), 3), "worst_s": round(max(took), 3)}


def main() -> None:
    """Measure and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the time; stores nothing")
    quick = parser.parse_args().quick
    result: dict[str, object] = {"goal_above_bare_us": GOAL_US}
    result["latency"] = latency(1000.0, 6.0 if quick else 60.0)
    print(json.dumps(result["latency"]), flush=True)
    result["roll"] = latency(25.0, 6.0 if quick else 40.0)
    print(json.dumps(result["roll"]), flush=True)
    result["router_returns"] = returns_s(2 if quick else 10)
    print(json.dumps(result["router_returns"]), flush=True)
    result["ceiling"] = {str(n): ceiling(n, 1.0 if quick else 3.0) for n in SUBSCRIBERS}
    if not quick:
        stored.store("wire", result)


if __name__ == "__main__":
    main()
