"""Time and memory of `import drumstick` beside bare Python: drumstick lab python-face [--runs 5].

Each program runs in processes of its own, by turns. Time is that of the processor, memory the largest resident set. Kernels are compiled beforehand. Stores lab/results/python_face.json; `drumstick lab measured-page` writes it into docs/measured.md.
"""

import argparse
import json
import statistics
import subprocess
import sys

from drumstick_lab.measuring import stored

SCENE = "import drumstick as ds; scene = ds.scene('roll')"
PROGRAMS = {
    "python": "pass",
    "import": "import drumstick",
    "numba": "import numba",
    "scene": SCENE,
    "simulate": f"{SCENE}; ds.simulate(scene, duration_s=10)",
}
# A process's own largest set: the one that wait() gives back has its parent's too.
_TELL = """
import time
own = dict(line.split(":") for line in open("/proc/self/status"))
print(time.process_time(), own["VmHWM"].split()[0])
"""


def spent(program: str) -> tuple[float, float]:
    """Processor seconds and MB of a process that runs it."""
    ran = subprocess.run(
        [sys.executable, "-c", program + _TELL], stdout=subprocess.PIPE, text=True, check=True
    ).stdout.split()
    return float(ran[0]), float(ran[1]) / 1024.0


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
    stored.store("python_face", {"runs": runs, "rows": rows})
    print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
