"""Time and memory of `import drumstick` beside bare Python, and time of the notebooks: drumstick lab python-face.

Each program runs in processes of its own, by turns (--runs 5); memory is the largest resident set, as the system
counts it when the process ends. Each notebook runs once, figures included, without a window: run this twice, so that
every kernel is compiled. Stores lab/results/python_face.json; `drumstick lab measured-page` writes it into docs/measured.md.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Any

from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring import stored

SCENE = "import drumstick as ds; scene = ds.scene('roll')"
PROGRAMS = {
    "python": "pass",
    "import": "import drumstick",
    "numba": "import numba",
    "scene": SCENE,
    "simulate": f"{SCENE}; ds.simulate(scene, duration_s=10)",
}


def spent(program: str) -> tuple[float, float]:
    """Seconds and MB of a process that runs it."""
    begun = time.perf_counter()
    _, status, used = os.wait4(os.posix_spawn(sys.executable, [sys.executable, "-c", program], os.environ), 0)
    if status:
        raise SystemExit(f"it failed: {program}")
    return time.perf_counter() - begun, used.ru_maxrss / 1024.0


def notebooks() -> dict[str, float]:
    """Seconds of each."""
    seconds: dict[str, float] = {}
    for path in sorted((DOCS / "notebooks").glob("*.py")):
        begun = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(
                [sys.executable, path],
                cwd=folder,
                env={**os.environ, "MPLBACKEND": "Agg"},
                stdout=subprocess.DEVNULL,
                check=True,
            )
        seconds[path.stem] = time.perf_counter() - begun
    return seconds


def main() -> None:
    """Measure, store, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    spent(PROGRAMS["simulate"])  # compiles
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in PROGRAMS}
    for _ in range(runs):
        for name, program in PROGRAMS.items():
            found[name].append(spent(program))
    rows = {
        name: {"s": statistics.median(s for s, _ in each), "MB": statistics.median(mb for _, mb in each)}
        for name, each in found.items()
    }
    result: dict[str, Any] = {"runs": runs, "rows": rows, "notebooks": notebooks()}
    stored.store("python_face", result)
    print(json.dumps(rows, indent=1), f"notebooks: {sum(result['notebooks'].values()):.0f} s", sep="\n")


if __name__ == "__main__":
    main()
