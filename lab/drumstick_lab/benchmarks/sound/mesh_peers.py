"""Cost of a junction beside other programs': drumstick lab mesh-peers [--rounds 41] [--faust-16].

Peers from Debian's packages, as they are distributed: STK's Mesh2D (11 x 11), SuperCollider's MembraneCircle and
MembraneHexagon (`scsynth -N`, the same score without membranes taken off), Faust's mesh_square, compiled with
g++ -O3 -march=native. Ours with 32 to 256 junctions across, for this processor and for one with AVX2 only. Per junction
and sample, CPU time; all of them in turn in short windows, round after round. Judged by the median of the rounds, theirs
and ours alike: scsynth is a process that is timed from outside, whose best run may be one that was timed badly. Beside
it the band in which the median lies with 95 % confidence, and the bests. Fewer than 15 rounds are not stored. At the end
`drumstick accuracy` measures the peers too, and what it finds is stored beside it: it shows that where they are not
installed.
"""

import argparse
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

from drumstick.drum.membrane.lattice import lattice_of
from drumstick_lab.accuracy.peers import compiled, stored_peers
from drumstick_lab.accuracy.peers.supercollider import RATE_HZ, Membranes, shape
from drumstick_lab.accuracy.peers.windows import MEMBRANES, missing, of_library, versions
from drumstick_lab.accuracy.timing import Window, median_band
from drumstick_lab.benchmarks.sound.our_mesh import Ours
from drumstick_lab.measuring import stored

ACROSS = (32, 64, 128, 256)
WINDOW_UPDATES = 4e6
SECONDS = 4.0
LEAST_ROUNDS = 15  # for a result that is stored
KINDS = ("MembraneCircle", "MembraneHexagon")
# Cost of a junction of theirs, as a multiple of ours at every size.
GOALS = {
    "ours": {"STK Mesh2D": 8.0, "SuperCollider MembraneCircle": 25.0},
    "ours AVX2": {"STK Mesh2D": 1.0 / 0.3},
}
_EMPTY = "the score without membranes"
# Every window here returns ns per junction and sample, but for scores: ns per sample of one membrane.


def per_junction(window: Window, junctions: int) -> Window:
    return lambda: window() / junctions


def of_score(folder: Path, kind: str) -> Window:
    """A score of membranes of a kind; of none of them for ""."""
    score = Membranes(folder, kind, MEMBRANES, SECONDS)
    return lambda: score.cpu_s() / (MEMBRANES * SECONDS * RATE_HZ) * 1e9


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


class Cost(NamedTuple):
    """Costs of a junction in every round, and at best."""

    rounds: list[float]
    best: float

    def row(self) -> dict[str, Any]:
        """The best, the median of the rounds, and the band of that."""
        return {
            "ns": self.best,
            "ns_median": statistics.median(self.rounds),
            "ns_band": median_band(self.rounds),
        }


def cost_of(ns: list[float], empty: list[float] | None = None, junctions: int = 1) -> Cost:
    """Cost from the rounds of a window. `empty`: rounds of a score without membranes, whose time is taken off."""
    if empty is None:
        return Cost(ns, min(ns))
    rounds = [(one - none) / junctions for one, none in zip(ns, empty, strict=True)]
    return Cost(rounds, (min(ns) - min(empty)) / junctions)


def ratios(costs: dict[str, Cost], peers: list[str], ours: list[str]) -> dict[str, Any]:
    """Cost of each peer as a multiple of ours: the median of the rounds' own, its band, and that of the bests."""
    rows: dict[str, Any] = {}
    for own in ours:
        rows[own] = {}
        for peer in peers:
            each = [a / b for a, b in zip(costs[peer].rounds, costs[own].rounds, strict=True)]
            rows[own][peer] = {
                "median": statistics.median(each),
                "band": median_band(each),
                "of_bests": costs[peer].best / costs[own].best,
            }
    return rows


def below(compared: dict[str, Any]) -> list[str]:
    """Goals that the medians miss."""
    return [
        f"{own}: {peer} should cost {goal:.1f} times as much, not {compared[own][peer]['median']:.1f}"
        for own in compared
        for peer, goal in GOALS[own.partition(" N = ")[0]].items()
        if compared[own][peer]["median"] < goal
    ]


def show(rows: dict[str, Any], compared: dict[str, Any]) -> None:
    for name, row in rows.items():
        least, most = row["ns_band"]
        print(
            f"{name:32s} {row['junctions']:6d} junctions  {row['ns_median']:7.3f} ({least:.3f}-{most:.3f})"
            f" ns a junction and sample, at best {row['ns']:.3f}"
        )
    for own, times in compared.items():
        words = (
            f"{peer} {r['median']:.1f} ({r['band'][0]:.1f}-{r['band'][1]:.1f})" for peer, r in times.items()
        )
        print(f"times {own}: " + ", ".join(words))
    for missed in below(compared):
        print(f"below the goal: {missed}")


def main(words: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=41)
    parser.add_argument("--faust-16", action="store_true", help="Faust's 16 x 16 too: minutes to compile")
    options = parser.parse_args(words)
    if options.rounds < LEAST_ROUNDS:
        print(f"{options.rounds} rounds: nothing will be stored; {LEAST_ROUNDS} are needed", flush=True)
    if lacking := missing():
        # Else libstk-dev brings JACK 1, in place of the jackd2 that the other benchmarks run on.
        packages = " ".join([*(["libjack-jackd2-dev"] if "libstk-dev" in lacking else []), *lacking])
        sys.exit(f"missing: {' '.join(lacking)}. To have it, type:\n  sudo apt-get install {packages}")
    windows: dict[str, Window] = {}
    junctions: dict[str, int] = {}
    engines = {"ours": Ours(), "ours AVX2": Ours(avx2=True)}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        libraries = {"STK Mesh2D": compiled.stk(folder), "Faust 8x8": compiled.faust(folder, 8)}
        if options.faust_16:
            libraries["Faust 16x16"] = compiled.faust(folder, 16)
        for label, library in libraries.items():
            junctions[label] = library.junctions
            windows[label] = per_junction(of_library(library), library.junctions)
        scores = {f"SuperCollider {kind}": of_score(folder, kind) for kind in KINDS}
        junctions |= {f"SuperCollider {kind}": shape(kind)[0] for kind in KINDS}
        windows |= scores
        peers = list(windows)
        windows[_EMPTY] = of_score(folder, "")
        for label, engine in engines.items():
            for across in ACROSS:
                name = f"{label} N = {across}"
                windows[name] = of_ours(engine, across)
                junctions[name] = lattice_of(2.0 / across).junctions
        found = measured(windows, options.rounds)
    empty = found.pop(_EMPTY)
    costs = {
        name: cost_of(ns, empty, junctions[name]) if name in scores else cost_of(ns)
        for name, ns in found.items()
    }
    lanes = {label: engine.lanes for label, engine in engines.items()}
    for engine in engines.values():
        engine.close()
    compared = ratios(costs, peers, [name for name in costs if name not in peers])
    rows = {name: {"junctions": junctions[name], **cost.row()} for name, cost in costs.items()}
    show(rows, compared)
    if options.rounds < LEAST_ROUNDS:
        return
    result = {
        "packages": versions(),
        "rounds": options.rounds,
        "lanes": lanes,
        "goals": GOALS,
        "rows": rows,
        "times_ours": compared,
    }
    stored.store("mesh_peers", result)
    if stored.is_of_the_checkout():
        stored_peers.store(options.rounds)


if __name__ == "__main__":
    main()
