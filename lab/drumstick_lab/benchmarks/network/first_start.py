"""Cost of the first start, which compiles every kernel, beside a second one: drumstick lab first-start [--runs 2].

`drumstick up` with an empty store of kernels, then again with what the first left there: seconds, and processor seconds
of all its processes, until an OSC client hears a strike and until the sound server has played one. Ratios are to Python
with numba and zenoh imported, from the same run. Stores lab/results/first_start.json.
"""

import argparse
import json
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


def started(kernels: Path) -> dict[str, float]:
    """One start with this store of kernels."""
    os.environ["XDG_CACHE_HOME"] = str(kernels)
    begun = time.monotonic()
    with running("up") as rig, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", rig.osc_out))
        ear.settimeout(0.05)

        def spent() -> tuple[float, float]:
            return time.monotonic() - begun, processor_s(rig.process.pid)

        wait_for("a strike by OSC", lambda: _heard(ear), _PATIENCE_S)
        strike_s, strike_cpu_s = spent()
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2)
    rows: dict[str, list[dict[str, float]]] = {"empty": [], "filled": []}
    baseline: list[float] = []
    for _ in range(parser.parse_args().runs):
        with tempfile.TemporaryDirectory(prefix="drumstick-kernels-") as folder:
            for store in rows:
                baseline.append(_imports_s())
                rows[store].append(started(Path(folder)))
                print(store, json.dumps(rows[store][-1]), flush=True)
    imports_s = statistics.median(baseline)
    medians = {
        store: {name: statistics.median(row[name] for row in found) for name in found[0]}
        for store, found in rows.items()
    }
    result = {"imports_s": imports_s, "runs": len(rows["empty"]), "rows": medians}
    stored.store("first_start", result)


if __name__ == "__main__":
    main()
