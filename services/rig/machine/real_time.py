"""Fitness of the machine's kernel and limits for a force loop; read, never changed. Linux."""

import contextlib
import os
import resource
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from haptic_server.servo.priority import FIFO_PRIORITY

MEMLOCK_BYTES = 200_000_000  # 121 MB were locked with everything loaded
LIMITS = "'@audio - rtprio 95' and '@audio - memlock unlimited' in /etc/security/limits.d/audio.conf"


class Seen(NamedTuple):
    """One thing looked at, and what to do about it where it could be better."""

    name: str
    good: bool
    found: str
    remedy: str = ""


def _text(path: Path) -> str | None:
    with contextlib.suppress(OSError):
        return path.read_text(encoding="utf-8", errors="replace").strip()
    return None


def _limit(name: str, kind: int, wanted: int) -> Seen:
    soft, _ = resource.getrlimit(kind)
    unlimited = soft == resource.RLIM_INFINITY
    root = os.geteuid() == 0
    found = "root" if root else "unlimited" if unlimited else str(soft)
    good = root or unlimited or soft >= wanted
    remedy = (
        f"for who logs in: {LIMITS}; the systemd units bring their own. What is gained, measure drumstick servo-test"
        " and drumstick audio-test"
    )
    return Seen(name, good, found, remedy)


def _preemption(root: Path) -> Seen:
    remedy = "boot with preempt=full, or install a kernel built for real time (Debian: linux-image-rt-amd64)"
    if _text(root / "sys/kernel/realtime") == "1":
        return Seen("kernel preemption", True, "real time (PREEMPT_RT)")
    cpuinfo = _text(
        root / "sys/kernel/debug/sched/preempt"
    )  # only root may read it; the one in force is in brackets
    if cpuinfo and "(" in cpuinfo:
        model = cpuinfo.partition("(")[2].partition(")")[0]
        return Seen("kernel preemption", model in ("full", "lazy"), model, remedy)
    built = _text(root / "proc/sys/kernel/version") or ""
    for word, good in (("PREEMPT_RT", True), ("PREEMPT_DYNAMIC", True), ("PREEMPT", True)):
        if word in built.split():
            chosen = _boot_option(root, "preempt") if word == "PREEMPT_DYNAMIC" else None
            words = f"{word}, preempt={chosen}" if chosen else word
            return Seen("kernel preemption", good and chosen not in ("none", "voluntary"), words, remedy)
    return Seen("kernel preemption", False, "voluntary or none", remedy)


def _boot_option(root: Path, name: str) -> str | None:
    words = (_text(root / "proc/cmdline") or "").split()
    return next((word.partition("=")[2] for word in reversed(words) if word.startswith(f"{name}=")), None)


def _governors(root: Path) -> Seen:
    found = sorted(
        {
            text
            for path in root.glob("sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor")
            if (text := _text(path))
        }
    )
    remedy = "cpupower frequency-set -g performance: a processor that sleeps deeply wakes late"
    words = ", ".join(found) or "not adjustable here"
    return Seen("cpu governor", set(found) <= {"performance"}, words, remedy)


def _throttling(root: Path) -> Seen:
    runtime, period = (_text(root / f"proc/sys/kernel/sched_rt_{name}_us") for name in ("runtime", "period"))
    if runtime is None or period is None:
        return Seen("real-time throttling", True, "none in this kernel")
    if runtime == "-1":
        remedy = (
            "a loop that hangs would take its processor for ever: sysctl kernel.sched_rt_runtime_us=950000"
        )
        return Seen("real-time throttling", False, "off", remedy)
    share = int(runtime) / int(period)
    remedy = "sysctl kernel.sched_rt_runtime_us=950000; a force loop takes far less, unless [servo] spin asks for all"
    return Seen("real-time throttling", share >= 0.9, f"{share:.0%} of each {int(period) / 1e6:g} s", remedy)


def processors(words: str) -> set[int]:
    """The numbers in a kernel's list, as "0,2-4". Anything else is left out."""
    found: set[int] = set()
    for part in words.split(","):
        first, dash, last = part.strip().partition("-")
        if first.isdecimal() and (not dash or last.isdecimal()):
            found |= set(range(int(first), int(last if dash else first) + 1))
    return found


def _interrupts_on(root: Path, isolated: set[int]) -> list[str]:
    found: list[str] = []
    for folder in root.glob("proc/irq/[0-9]*"):
        allowed = _text(folder / "effective_affinity_list") or _text(folder / "smp_affinity_list")
        if allowed and processors(allowed) & isolated:
            found.append(folder.name)
    return sorted(found, key=int)


def _named(numbers: Iterable[str], most: int = 8) -> str:
    listed = list(numbers)
    return ", ".join(listed[:most]) + (f" and {len(listed) - most} more" if len(listed) > most else "")


def _isolation(root: Path) -> list[Seen]:
    isolated = processors(_text(root / "sys/devices/system/cpu/isolated") or "")
    if not isolated:
        words = "none; with [servo] cpu and isolcpus=N at boot the force loop has one for itself"
        return [Seen("isolated processor", True, words)]
    named = ", ".join(str(number) for number in sorted(isolated))
    seen = Seen("isolated processor", True, f"{named}: give its number as [servo] cpu of the scene")
    disturbing = _interrupts_on(root, isolated)
    remedy = "irqaffinity= at boot, or write other processors to /proc/irq/N/smp_affinity_list; irqbalance must not run"
    words = f"interrupts {_named(disturbing)} come on it" if disturbing else "none comes on it"
    return [seen, Seen("interrupts of the isolated processor", not disturbing, words, remedy)]


def examine(root: Path = Path("/")) -> list[Seen]:
    """Everything, below `root`: a stand-in's files in tests."""
    return [
        _limit("real-time priority", resource.RLIMIT_RTPRIO, FIFO_PRIORITY),
        _limit("locked memory", resource.RLIMIT_MEMLOCK, MEMLOCK_BYTES),
        _governors(root),
        _preemption(root),
        _throttling(root),
        *_isolation(root),
    ]
