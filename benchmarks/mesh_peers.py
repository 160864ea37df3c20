"""What a junction costs beside others: python benchmarks/mesh_peers.py [--rounds 15] [--faust-16].

Peers from Debian's packages, as they are distributed: STK's Mesh2D (11 x 11), SuperCollider's MembraneCircle and
MembraneHexagon (`scsynth -N`, the same score without membranes taken off), Faust's mesh_square, compiled with
g++ -O3 -march=native. Ours with 32 to 256 junctions across, for this processor and for one with AVX2 only. Per junction
and sample, CPU time; everything in turn in short windows, and of each the best. Ratios: of the bests, and the median of
the rounds' own, which tells how far the machine's noise can be in the former.
"""

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from bare_mesh import RATE_HZ, timed
from machine import description
from peers import compiled
from peers.ours import Ours
from peers.supercollider import Membranes, shape

from sound_server.membrane.lattice import lattice_of

RESULT = HERE / "results" / "mesh_peers.json"
ACROSS = (32, 64, 128, 256)
WINDOW_UPDATES = 4e6
# Enough of them that starting scsynth is little beside them.
MEMBRANES, SECONDS = 8, 4.0
PACKAGES = {
    "libstk-dev": lambda: Path("/usr/include/stk/Mesh2D.h").exists(),
    "faust": lambda: shutil.which("faust"),
    "supercollider-server": lambda: shutil.which("scsynth"),
    "sc3-plugins-server": lambda: Path("/usr/lib/SuperCollider/plugins/MembraneUGens.so").exists(),
    "g++": lambda: shutil.which("g++"),
}
GOALS = {"STK Mesh2D": 8.0, "SuperCollider MembraneCircle": 25.0}
AVX2_GOAL = 1.0 / 0.3
# Returns ns per junction and sample.
Window = Callable[[], float]


def missing() -> list[str]:
    return [name for name, is_there in PACKAGES.items() if not is_there()]


def in_process(library: compiled.Library) -> Window:
    samples = max(512, round(WINDOW_UPDATES / library.junctions / 512 / 8) * 512)
    library.run(512)
    return lambda: timed(lambda: library.run(samples)) / samples / library.junctions * 1e9


def of_ours(ours: Ours, across: int) -> Window:
    junctions = lattice_of(2.0 / across).junctions
    steps = 2 * max(10, round(WINDOW_UPDATES / junctions / 2))
    ours.cpu_s(across, 20)
    return lambda: ours.cpu_s(across, steps) / steps / junctions * 1e9


def of_supercollider(folder: Path, kind: str) -> Window:
    with_them = Membranes(folder, kind, MEMBRANES, SECONDS)
    without = Membranes(folder, "", MEMBRANES, SECONDS)
    updates = MEMBRANES * SECONDS * RATE_HZ * shape(kind)[0]
    least = min(without.cpu_s() for _ in range(5))

    def window() -> float:
        nonlocal least
        least = min(least, without.cpu_s())
        return (with_them.cpu_s() - least) / updates * 1e9

    return window


def measured(windows: dict[str, Window], rounds: int) -> dict[str, list[float]]:
    """ns of every window in every round, the windows of a round in turn."""
    found: dict[str, list[float]] = {name: [] for name in windows}
    for _ in range(rounds):
        for name, window in windows.items():
            found[name].append(window())
    return found


def ratios(found: dict[str, list[float]], peers: list[str], ours: list[str]) -> dict[str, Any]:
    """How many times ours a peer's cost is."""
    rows: dict[str, Any] = {}
    for own in ours:
        rows[own] = {
            peer: {
                "of_bests": min(found[peer]) / min(found[own]),
                "median": statistics.median(a / b for a, b in zip(found[peer], found[own], strict=True)),
            }
            for peer in peers
        }
    return rows


def versions() -> dict[str, str]:
    said = subprocess.run(
        ["dpkg-query", "-W", "-f", "${Package} ${Version}\n", "libstk-dev", *list(PACKAGES)[1:]],
        capture_output=True,
        text=True,
        check=False,
    ).stdout
    return dict(line.split(" ", 1) for line in said.splitlines())


def show(found: dict[str, list[float]], junctions: dict[str, int], compared: dict[str, Any]) -> None:
    for name, ns in found.items():
        print(f"{name:32s} {junctions[name]:6d} junctions  {min(ns):7.3f} ns a junction and sample")
    for own, row in compared.items():
        words = [f"{peer} {ratio['of_bests']:.1f} ({ratio['median']:.1f})" for peer, ratio in row.items()]
        print(f"times {own}: " + ", ".join(words))
        goals = {"STK Mesh2D": AVX2_GOAL} if "AVX2" in own else GOALS
        for peer, goal in goals.items():
            if row[peer]["of_bests"] < goal:
                print(f"  below the goal: {peer} should cost {goal:.1f} times as much")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--faust-16", action="store_true", help="Faust's 16 x 16 too: minutes to compile")
    options = parser.parse_args()
    if lacking := missing():
        sys.exit(
            f"missing: {' '.join(lacking)}. To have it, type:\n  sudo apt-get install {' '.join(lacking)}"
        )
    windows: dict[str, Window] = {}
    junctions: dict[str, int] = {}
    engines = {"ours": Ours(), "ours AVX2": Ours(avx2=True)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        libraries = {"STK Mesh2D": compiled.stk(folder), "Faust 8x8": compiled.faust(folder, 8)}
        if options.faust_16:
            libraries["Faust 16x16"] = compiled.faust(folder, 16)
        for label, library in libraries.items():
            windows[label], junctions[label] = in_process(library), library.junctions
        for kind in ("MembraneCircle", "MembraneHexagon"):
            label = f"SuperCollider {kind}"
            windows[label], junctions[label] = of_supercollider(folder, kind), shape(kind)[0]
        peers = list(windows)
        for label, engine in engines.items():
            for across in ACROSS:
                row = f"{label} N = {across}"
                windows[row] = of_ours(engine, across)
                junctions[row] = lattice_of(2.0 / across).junctions
        found = measured(windows, options.rounds)
    lanes = {label: engine.lanes for label, engine in engines.items()}
    for engine in engines.values():
        engine.close()
    compared = ratios(found, peers, [row for row in windows if row not in peers])
    show(found, junctions, compared)
    result = {
        "machine": description(),
        "packages": versions(),
        "rounds": options.rounds,
        "lanes": lanes,
        "rows": {
            row: {"junctions": junctions[row], "ns": min(ns), "ns_median": statistics.median(ns)}
            for row, ns in found.items()
        },
        "times_ours": compared,
    }
    RESULT.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
