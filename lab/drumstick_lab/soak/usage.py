"""Usage of processes, from /proc: memory, descriptors, threads, switches, processor time. Linux only."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

_PROC = Path("/proc")
_TICKS_A_SECOND = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


class Usage(NamedTuple):
    """Usage of one process, or of a service with its children together."""

    processes: int
    rss_kB: int
    pss_kB: int
    descriptors: int
    threads: int
    switches: int  # voluntary and not, since the start
    cpu_s: float  # since the start


def is_readable() -> bool:
    """True when this system tells all of it."""
    return (_PROC / "self" / "smaps_rollup").exists()


def _fields(path: Path) -> dict[str, int]:
    lines = (line.partition(":") for line in path.read_text(encoding="ascii", errors="replace").splitlines())
    words = ((name, rest.split()) for name, _, rest in lines)
    return {name: int(rest[0]) for name, rest in words if rest and rest[0].isdigit()}


def usage(pid: int) -> Usage:
    """Usage of one process. ProcessLookupError or FileNotFoundError when it has gone."""
    place = _PROC / str(pid)
    status = _fields(place / "status")
    stat = (place / "stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
    switches = status.get("voluntary_ctxt_switches", 0) + status.get("nonvoluntary_ctxt_switches", 0)
    return Usage(
        processes=1,
        rss_kB=status.get("VmRSS", 0),
        pss_kB=_fields(place / "smaps_rollup").get("Pss", 0),
        descriptors=len(os.listdir(place / "fd")),
        threads=status.get("Threads", 0),
        switches=switches,
        cpu_s=(int(stat[11]) + int(stat[12])) / _TICKS_A_SECOND,
    )


def together(each: Iterable[Usage]) -> Usage:
    """The sums. ValueError when there is none."""
    found = list(each)
    if not found:
        raise ValueError("no process")
    return Usage(*(sum(column) for column in zip(*found, strict=True)))


def children(pid: int) -> list[int]:
    """Processes that this one started and that still run; none when it has gone."""
    found: list[int] = []
    try:
        for task in (_PROC / str(pid) / "task").iterdir():
            found += [int(word) for word in (task / "children").read_text(encoding="ascii").split()]
    except (FileNotFoundError, ProcessLookupError):
        return found
    return found


def family(pid: int) -> list[int]:
    """A process and all that descend from it."""
    return [pid, *(one for child in children(pid) for one in family(child))]


def module_of(pid: int) -> str | None:
    """Module given to `python -m`; None for another process, or one that has gone."""
    try:
        words = (_PROC / str(pid) / "cmdline").read_bytes().decode("utf-8", "replace").split("\0")
    except (FileNotFoundError, ProcessLookupError):
        return None
    return words[words.index("-m") + 1] if "-m" in words[:-1] else None


def service_usage(pid: int, apart: Iterable[int] = ()) -> Usage | None:
    """Usage of a process and its descendants but for those `apart` and theirs; None when it has gone."""
    left_out = {one for each in apart for one in family(each)}
    try:
        return together(usage(one) for one in family(pid) if one not in left_out)
    except (FileNotFoundError, ProcessLookupError, ValueError):
        return None
