"""Cost of a junction beside other programs': drumstick lab mesh-peers [--rounds 15] [--faust-16].

Peers from Debian's packages, as they are distributed: STK's Mesh2D (11 x 11), SuperCollider's MembraneCircle and
MembraneHexagon (`scsynth -N`, the same score without membranes taken off), Faust's mesh_square, compiled with
g++ -O3 -march=native. Ours with 32 to 256 junctions across, for this processor and for one with AVX2 only. Per junction
and sample, CPU time; everything in turn in short windows, and of each the best. Ratios: of the bests, and the median of
the rounds' own, which tells how far the machine's noise can be in the former. At the end `drumstick accuracy` measures
the peers too, and what it finds is stored beside it: it shows that where they are not installed.
"""

import argparse
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any

from drumstick.drum.membrane.lattice import lattice_of
from drumstick_lab.accuracy.peers import compiled, stored_peers
from drumstick_lab.accuracy.peers.supercollider import shape
from drumstick_lab.accuracy.peers.windows import missing, of_library, of_supercollider, versions
from drumstick_lab.accuracy.timing import Window
from drumstick_lab.benchmarks.sound.our_mesh import Ours
from drumstick_lab.measuring import stored

ACROSS = (32, 64, 128, 256)
WINDOW_UPDATES = 4e6
SECONDS = 4.0
GOALS = {"STK Mesh2D": 8.0, "SuperCollider MembraneCircle": 25.0}
AVX2_GOAL = 1.0 / 0.3
# Every window here returns ns per junction and sample.


def per_junction(window: Window, junctions: int) -> Window:
    return lambda: window() / junctions


def of_ours(ours: Ours, across: int) -> Window:
    junctions = lattice_of(2.0 / across).junctions
    steps = 2 * max(10, round(WINDOW_UPDATES / junctions / 2))
    ours.cpu_s(across, 20)
    return lambda: ours.cpu_s(across, steps) / steps / junctions * 1e9


def measured(windows: dict[str, Window], rounds: int) -> dict[str, list[float]]:
    """ns of every window in every round, the windows of a round in turn."""
    found: dict[str, list[float]] = {name: [] for name in windows}
    for _ in range(rounds):
        for name, window in windows.items():
            found[name].append(window())
    return found


def ratios(found: dict[str, list[float]], peers: list[str], ours: list[str]) -> dict[str, Any]:
    """Cost of each peer as a multiple of ours."""
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
            junctions[label] = library.junctions
            windows[label] = per_junction(of_library(library), library.junctions)
        for kind in ("MembraneCircle", "MembraneHexagon"):
            label = f"SuperCollider {kind}"
            junctions[label] = shape(kind)[0]
            windows[label] = per_junction(of_supercollider(folder, kind, SECONDS), junctions[label])
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
        "packages": versions(),
        "rounds": options.rounds,
        "lanes": lanes,
        "rows": {
            row: {"junctions": junctions[row], "ns": min(ns), "ns_median": statistics.median(ns)}
            for row, ns in found.items()
        },
        "times_ours": compared,
    }
    stored.store("mesh_peers", result)
    if stored.is_of_the_checkout():
        stored_peers.store(options.rounds)


if __name__ == "__main__":
    main()
