"""Delivery of one rig's messages to many listeners: drumstick lab listeners [--quick] stores results/listeners.json.

A real Zenoh router in a process of its own; a process that puts what a rig puts, at a rig's rates
(lab/drumstick_lab/rig_load.py); up to 300 real subscribers, each with a session of its own, in four more processes. All on
loopback, in a network namespace of their own, so that its byte counter counts nothing else. For each number of
listeners: the share that was delivered, how late strikes came, what the router's processor time was for each message
delivered, and that against one listener's in the same run. Then two routers one behind the other, and a tree of three.
"""

import argparse
import ctypes
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from lone_router import lone_router

from drumstick_lab.measuring import stored
from drumstick_lab.rig_load import payload_bytes_per_s, per_s

COUNTS = (1, 10, 30, 100, 300)
PROCESSES = 4
_CLONE_NEWNET = 0x40000000
_DRAIN_S = 1.0


class End:
    """A process of listeners_end.py."""

    def __init__(self, *words: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "drumstick_lab.benchmarks.network.listeners_end", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def line(self) -> Any:
        """Next line of its output."""
        assert self.process.stdout is not None
        said = self.process.stdout.readline()
        if not said:
            raise RuntimeError(f"{self.process.args} ended")
        return json.loads(said)

    def go(self) -> None:
        """Let it go on."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def end(self) -> Any:
        """Its last words, if it has any."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        said = self.process.stdout.read()
        if self.process.wait(120) != 0:
            raise RuntimeError(f"{self.process.args} ended with status {self.process.returncode}")
        return json.loads(said) if said.strip() else None


class Layout(NamedTuple):
    """Endpoint at which the rig puts, and the routers at which listeners sit, in turn."""

    at: str
    listeners_at: Sequence[str]
    pids: Sequence[int]  # of the routers, the rig's own first


def alone_in_a_namespace() -> None:
    """A loopback interface of our own. OSError where that is not permitted."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(_CLONE_NEWNET) != 0:
        raise OSError(ctypes.get_errno(), "a network namespace of our own: run this as root")
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)


def loopback_bytes() -> int:
    """Received so far, headers of TCP and IP included."""
    rows = Path("/proc/net/dev").read_text(encoding="utf-8").splitlines()
    (row,) = (line.split(":")[1].split() for line in rows if line.strip().startswith("lo:"))
    return int(row[0])


def cpu_s(pid: int) -> float:
    """Processor time of a process's threads so far, to the nanosecond."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return 1e-9 * sum(int((task / "schedstat").read_text(encoding="ascii").split()[0]) for task in tasks)


def run(layout: Layout, profile: str, listeners: int, seconds: float) -> dict[str, Any]:
    """One row."""
    processes = min(PROCESSES, listeners)
    shares = [listeners // processes + (k < listeners % processes) for k in range(processes)]
    ears = [
        End("hear", layout.listeners_at[k % len(layout.listeners_at)], profile, str(share))
        for k, share in enumerate(shares)
    ]
    mouth = End("put", layout.at, profile, str(seconds))
    for each in (*ears, mouth):
        assert each.line() == "ready"
    time.sleep(_DRAIN_S)  # declarations have gone round
    before, bytes_before = [cpu_s(pid) for pid in layout.pids], loopback_bytes()
    begun = time.monotonic()
    mouth.go()
    report = mouth.line()
    time.sleep(_DRAIN_S)
    took_s = time.monotonic() - begun
    used = [cpu_s(pid) - at for pid, at in zip(layout.pids, before, strict=True)]
    carried = loopback_bytes() - bytes_before
    mouth.end()
    said = [ear.end() for ear in ears]
    heard = [count for each in said for count in each["heard"]]
    late_us = np.array([late for each in said for late in each["late_us"]])
    p50, p99 = np.percentile(late_us, (50, 99)) if len(late_us) else (float("nan"),) * 2
    delivered = sum(heard)
    foreign = [words for each in said for words in each["foreign"]]
    if foreign:
        print("another stream's message at a subscriber of strikes:", foreign[:3], flush=True)
    return {
        "listeners": listeners,
        "put": report["put"],
        "put_latest_ms": report["latest_ms"],
        "delivered_share": round(delivered / (report["put"] * listeners), 5),
        "worst_listener_share": round(min(heard) / report["put"], 5),
        "delivered_per_s": round(delivered / seconds),
        "of_another_stream": len(foreign),
        "p50_us": round(float(p50)),
        "p99_us": round(float(p99)),
        "router_cpu_us_per_delivery": round(1e6 * used[0] / delivered, 2),
        "router_share_of_core": [round(each / took_s, 3) for each in used],
        "bytes_per_delivery": round(carried / delivered),
    }


def many(profile: str, counts: Sequence[int], seconds: float) -> dict[str, Any]:
    """All numbers of listeners at one router; the first one is the baseline of the rest."""
    rows: list[dict[str, Any]] = []
    for listeners in counts:
        with lone_router() as router:
            row = run(Layout(router.endpoint, [router.endpoint], [router.pid]), profile, listeners, seconds)
        base = rows[0] if rows else row
        row["cpu_to_one_listener"] = round(
            row["router_cpu_us_per_delivery"] / base["router_cpu_us_per_delivery"], 3
        )
        rows.append(row)
        print(profile, row, flush=True)
    return {
        "messages_per_s": round(per_s(profile), 2),
        "payload_bytes_per_s": round(payload_bytes_per_s(profile)),
        "rows": rows,
    }


def chained(profile: str, listeners: int, seconds: float) -> dict[str, Any]:
    """Listeners at the rig's router, behind a second one, and behind two that share them."""
    report: dict[str, Any] = {"profile": profile}
    with ExitStack() as routers:
        first = routers.enter_context(lone_router())
        report["one router"] = run(
            Layout(first.endpoint, [first.endpoint], [first.pid]), profile, listeners, seconds
        )
        second = routers.enter_context(lone_router(first.endpoint))
        pids = [first.pid, second.pid]
        report["behind a second"] = run(
            Layout(first.endpoint, [second.endpoint], pids), profile, listeners, seconds
        )
        third = routers.enter_context(lone_router(first.endpoint))
        layout = Layout(first.endpoint, [second.endpoint, third.endpoint], [*pids, third.pid])
        report["behind two"] = run(layout, profile, listeners, seconds)
    for name in ("one router", "behind a second", "behind two"):
        print(name, report[name], flush=True)
    return report


def main() -> None:
    """Measure and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few listeners, a second each; stores nothing")
    parser.add_argument("--most", type=int, default=COUNTS[-1], help="listeners at most")
    parser.add_argument("--seconds", type=float, default=8.0, help="of each run")
    given = parser.parse_args()
    quick = given.quick
    alone_in_a_namespace()
    counts = COUNTS[:2] if quick else [count for count in COUNTS if count <= given.most]
    seconds = 1.0 if quick else given.seconds
    report: dict[str, Any] = {
        "load_before": os.getloadavg()[0],
        "seconds": seconds,
        "processes_of_listeners": PROCESSES,
        "profiles": {name: many(name, counts, seconds) for name in ("follower", "everything")},
        "chained": chained("follower", 4 if quick else 30, seconds),
    }
    if not quick:
        stored.store("listeners", report)


if __name__ == "__main__":
    main()
