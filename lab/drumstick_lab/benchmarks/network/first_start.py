"""Cost of the first start, which compiles every kernel, beside a second one: drumstick lab first-start [--runs 2]
[--beside CHECKOUT].

`drumstick up` with an empty store of kernels, then again with what the first left there: seconds, and processor seconds
of all its processes, until an OSC client hears a strike and until the sound server has played one. Ratios are to Python
with numba and zenoh imported, from the same run. --beside: another version's checkout, whose sources this
installation's Python starts in turns with its own, until the strike. Stores lab/results/first_start.json.
"""

import argparse
import compileall
import json
import math
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from rig_process import Listener, Rig, running, wait_for

from drumstick_lab.measuring import stored
from protocol.messages import Meter

_PATIENCE_S = 600.0
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
_OWN = os.environ.get("PYTHONPATH", "")


def processor_s(pid: int) -> float:
    """Processor time of a process, its children, and those of them that have ended."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    own = sum(int(ticks) for ticks in fields[11:15]) * _TICK_S
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return own + sum(processor_s(int(child)) for child in children)


def _heard(ear: socket.socket) -> bool:
    try:
        return b"/drumstick/strike" in ear.recv(4096)
    except TimeoutError:
        return False


def started(kernels: Path, checkout: Path | None = None) -> dict[str, float]:
    """One start with this store of kernels; of another checkout until the strike, as its meter may be another one."""
    os.environ["XDG_CACHE_HOME"] = str(kernels)
    os.environ["PYTHONPATH"] = _OWN if checkout is None else f"{checkout / 'shared'}:{checkout / 'services'}"
    begun = time.monotonic()
    with running("up") as rig, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", rig.osc_out))
        ear.settimeout(0.05)

        def spent() -> tuple[float, float]:
            return time.monotonic() - begun, processor_s(rig.process.pid)

        wait_for("a strike by OSC", lambda: _heard(ear), _PATIENCE_S)
        strike_s, strike_cpu_s = spent()
        if checkout is not None:
            _settle(rig.process.pid)
            return {"strike_s": strike_s, "strike_processor_s": strike_cpu_s}
        sound_s, sound_cpu_s = _sounding(rig, spent)
    return {
        "strike_s": strike_s, "strike_processor_s": strike_cpu_s,
        "sound_s": sound_s, "sound_processor_s": sound_cpu_s,
    }  # fmt: skip


def _sounding(rig: Rig, spent: Any) -> tuple[float, float]:
    session = rig.client()
    meters = Listener(session, rig.keys.meter, Meter)
    wait_for("sound", lambda: meters.got and meters.got[-1].played > 0, _PATIENCE_S)
    found: tuple[float, float] = spent()
    session.close()
    return found


def _imports_s() -> float:
    begun = time.monotonic()
    subprocess.run([sys.executable, "-c", "import numba, zenoh"], check=True)
    return time.monotonic() - begun


def _settle(pid: int) -> None:
    # All is compiled and stored: they take less than half a core.
    spent, before = processor_s(pid), -math.inf
    while spent - before > 0.5:
        time.sleep(1.0)
        before, spent = spent, processor_s(pid)


def _version(checkout: Path) -> str:
    told = [["git", "describe", "--always", "--dirty"], ["git", "log", "-1", "--format=%as"]]
    said = [subprocess.run(words, cwd=checkout, capture_output=True, text=True, check=True) for words in told]
    return " of ".join(each.stdout.strip() for each in said)


def _medians(rows: dict[str, list[dict[str, float]]]) -> dict[str, dict[str, float]]:
    return {
        store: {name: statistics.median(row[name] for row in found) for name in found[0]}
        for store, found in rows.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2)
    parser.add_argument("--beside", type=Path, metavar="CHECKOUT")
    given = parser.parse_args()
    versions: dict[Path, str] = {}
    if given.beside is not None:
        if not (given.beside / "services" / "rig").is_dir():
            parser.error(f"{given.beside} is no checkout of the instrument")
        beside = given.beside.resolve()
        versions[beside] = _version(beside)
        for folder in ("shared", "services"):  # as those of an installation are
            compileall.compile_dir(beside / folder, quiet=1)
    os.environ.pop("OPENBLAS_NUM_THREADS", None)  # each version sets its own
    checkouts = [None, *versions]
    rows: dict[Path | None, dict[str, list[dict[str, float]]]] = {
        checkout: {"empty": [], "filled": []} for checkout in checkouts
    }
    baseline: list[float] = []
    for _ in range(given.runs):
        for checkout in checkouts:
            with tempfile.TemporaryDirectory(prefix="drumstick-kernels-") as folder:
                for store, found in rows[checkout].items():
                    baseline.append(_imports_s())
                    found.append(started(Path(folder), checkout))
                    print(checkout or "this version", store, json.dumps(found[-1]), flush=True)
    result: dict[str, Any] = {
        "imports_s": statistics.median(baseline),
        "runs": given.runs,
        "rows": _medians(rows[None]),
    }
    for checkout, version in versions.items():
        result["beside"] = {"version": version, "rows": _medians(rows[checkout])}
    stored.store("first_start", result)


if __name__ == "__main__":
    main()
