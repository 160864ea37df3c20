"""Two loops in the same window, ours and one in C, and what their lateness looks like side by side."""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from haptic_server.servo.priority import FIFO_PRIORITY
from haptic_server.servo.stall_detector import StallDetector, without_host_stalls

HERE = Path(__file__).parent

PERCENTILES = (50.0, 90.0, 99.0, 99.9, 99.99, 100.0)
WARM_TICKS = 100
_LEAD_NS = 300_000_000  # both loops are waiting for their first tick by then

Times = npt.NDArray[np.int64]


class Kept(NamedTuple):
    """Record of each tick: when it was due, how late it came, ns."""

    due_ns: Times
    late_ns: Times


class Loop(Protocol):
    """A loop that can be asked to play some ticks, and then for what it kept."""

    def start(self, first_ns: int, ticks: int) -> None: ...

    def kept(self) -> Kept: ...


def built(folder: Path) -> Path:
    """The loop in C, compiled into `folder` by the system's compiler."""
    program = folder / "lateness_loop"
    source = str(HERE / "lateness_loop.c")
    subprocess.run(["cc", "-O2", "-Wall", "-Wextra", "-o", str(program), source], check=True, timeout=60)
    return program


class CLoop:
    """The loop in C: a process each time."""

    def __init__(self, program: Path, scene: Scene, name: str = "c") -> None:
        self._program, self._file = program, program.parent / f"{name}.bin"
        self._servo = scene.servo
        self.granted: dict[str, str] = {}

    def start(self, first_ns: int, ticks: int) -> None:
        servo = self._servo
        given = (first_ns, round(1e9 / servo.rate_Hz), ticks + WARM_TICKS, servo.spin_us * 1000, servo.cpu)
        command = [str(self._program), *map(str, given), str(FIFO_PRIORITY), str(self._file)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    def kept(self) -> Kept:
        said, _ = self._process.communicate(timeout=120)
        assert self._process.returncode == 0, said
        self.granted = json.loads(said)
        due, late = np.fromfile(self._file, np.int64).reshape(-1, 2)[WARM_TICKS:].T
        return Kept(due, late)


class ServoLoop:
    """Ours: one process for all windows. `run_dir` holds scene.toml; the block is made there."""

    def __init__(self, run_dir: Path, busy: bool = False) -> None:
        self._file = run_dir / "ours.npy"
        command = [
            sys.executable,
            "-m",
            "drumstick_lab.benchmarks.force_loop.lateness_servo",
            "--run-dir",
            str(run_dir),
        ]
        command += ["--busy"] if busy else []
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._in, self._out = self._process.stdin, self._process.stdout
        self.granted: dict[str, str] = {}
        self.ended: list[dict[str, Any]] = []
        self.spent_ns: list[Times] = []
        if (line := self._out.readline()) != "ready\n":
            raise RuntimeError(f"the servo did not start: it said {line!r}")

    def start(self, first_ns: int, ticks: int) -> None:
        self._in.write(f"{first_ns} {ticks} {self._file}\n")
        self._in.flush()

    def kept(self) -> Kept:
        ended = json.loads(self._out.readline())
        self.granted = ended.pop("granted")
        self.ended.append(ended)
        due, late, spent = np.load(self._file)
        self.spent_ns.append(spent)
        return Kept(due, late)

    def close(self) -> None:
        self._in.close()
        self._process.terminate()  # a thread that spins does not end by itself
        self._process.wait(20.0)
        self._out.close()


class Window(NamedTuple):
    """Ticks of two loops in the same stretch of time, and the host's stalls in it."""

    ours: Kept
    other: Kept
    stalls: Times
    refused: list[str]


def window(ours: Loop, other: Loop, rate_Hz: int, ticks: int, swapped: bool) -> Window:
    """Both loops at the same time, half a period apart; `swapped`: the second comes first."""
    half = round(0.5e9 / rate_Hz)
    with StallDetector() as probes:
        first = time.monotonic_ns() + _LEAD_NS
        ours.start(first + half * swapped, ticks)
        other.start(first + half * (not swapped), ticks)
        kept = ours.kept(), other.kept()
    return Window(*kept, probes.stalls(), probes.refused)


def discounted(kept: Kept, stalls: Times) -> Times:
    """Lateness without what witnesses saw, ns."""
    return without_host_stalls(kept.due_ns, kept.late_ns, stalls)


def percentiles(late_ns: Times) -> dict[str, float]:
    """Percentiles by name, us."""
    found = np.percentile(late_ns, PERCENTILES) / 1e3
    names = [f"p{p:g}_us" for p in PERCENTILES[:-1]] + ["max_us"]
    return dict(zip(names, found.round(2).tolist(), strict=True))


def summary(kept: list[Kept], stalls: list[Times]) -> dict[str, Any]:
    """Summary of all windows: ticks, percentiles as they were and discounted, how much was discounted."""
    late = np.concatenate([each.late_ns for each in kept])
    left = np.concatenate([discounted(each, seen) for each, seen in zip(kept, stalls, strict=True)])
    return {
        "ticks": len(late),
        "lateness": percentiles(late),
        "discounted": percentiles(left),
        "ticks_discounted": int(np.count_nonzero(left < late)),
        "seconds_discounted": float(np.sum(late - left)) * 1e-9,
    }


def compared(windows: list[Window]) -> dict[str, Any]:
    """Both summaries and the ratios of ours to the other, discounted: of all ticks, and window by window."""
    stalls = [each.stalls for each in windows]
    ours = summary([each.ours for each in windows], stalls)
    other = summary([each.other for each in windows], stalls)
    ratios: dict[str, Any] = {}
    for p in (50.0, 99.0):
        name = f"p{p:g}"
        ratios[name] = ours["discounted"][f"{name}_us"] / other["discounted"][f"{name}_us"]
        ratios[f"{name}_by_window"] = [
            float(np.percentile(discounted(w.ours, w.stalls), p))
            / float(np.percentile(discounted(w.other, w.stalls), p))
            for w in windows
        ]
    longest = [float((seen[:, 1] - seen[:, 0]).max(initial=0)) / 1e3 for seen in stalls]
    return {
        "ours": ours,
        "c": other,
        "ratio": ratios,
        "host_stalls": sum(len(seen) for seen in stalls),
        "longest_host_stall_us": max(longest),
        "witnesses_refused": sorted({words for w in windows for words in w.refused}),
    }
