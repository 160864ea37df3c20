"""Numbers that got worse between two runs of what is stored: drumstick lab worse NEW [OLD] [--by 1.3].

Each is a result of `drumstick accuracy`, or a folder of results as `drumstick lab measure --all --out DIR` stores them;
OLD is what comes with the package, if not given. Of folders those costs are compared that have a yardstick in the same
run (lab/drumstick_lab/measuring/yardsticks.py), and accuracy.json, where both have it.

Costs are compared as ratios to a yardstick of the same run, so the machine's own speed falls out, though not its noise:
a row counts when its ratio grew by more than `--by`. Rows of accuracy are matched by what they are about. Errors hardly
depend on the machine: a row counts when one grew by a tenth, if it is more than rounding; so do its other figures, each
in its own direction. Prints what got worse, then what got better. Exits with 1 where something got worse, or where of
two runs of accuracy that are alike in kind the new one lacks rows of the old one.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from drumstick_lab.accuracy.store import shipped
from drumstick_lab.checkout import RESULTS
from drumstick_lab.measuring import stored
from drumstick_lab.measuring.yardsticks import RATIOS, ratios

# What a row is about, by its list.
ABOUT = {
    ("stick", "rows"): ("method", "locates", "dt_s", "rtol"),
    ("servo", "rows"): ("k_coll", "rate_Hz", "delay_ticks", "predictor", "filter"),
    ("mesh", "rows"): ("renderer", "scheme", "rim", "precision", "rate_Hz", "modes"),
    ("excitation", "rows"): ("kind", "rate_Hz"),
    ("effects", "sample"): ("effect",),
    ("effects", "tick"): ("effect",),
    ("whole", "rows"): ("stage", "playing", "choice"),
}
ERRORS = (
    "error_contacts", "error_v_lc", "error_rate", "energy", "rms_cents", "worst_cents", "decay_error",
    "f01_cents", "force_error_dB", "sound_error_dB", "magnitude_error_dB",
    "latency_ms", "bytes_per_strike", "guarded_most", "restitution_least", "restitution_most",
    "jnds",
)  # fmt: skip
# More is better, and what is either so or not.
GAINS = ("bandwidth_Hz", "modes_found")
PROMISES = ("passes_envelope",)
GREW = 1.1
ROUNDING = 1e-9
ROUNDING_DB = 0.5
ROUNDING_ENERGY = 1e-3
SPREAD = ("least", "most")
COMPOSED_BY = (
    1.03  # no effects cost no effects: that is held more closely than a machine's noise allows otherwise
)


class Change(NamedTuple):
    what: str
    key: str
    before: float
    after: float

    def words(self) -> str:
        return f"{self.what}: {self.key} {self.before:.4g} -> {self.after:.4g}"


def _rows(found: dict[str, Any], part: str, name: str) -> dict[str, dict[str, Any]]:
    rows: dict[str, dict[str, Any]] = {}
    for row in found.get(part, {}).get(name, []):
        # Banks of modes differ by their number alone, which is theirs by their top; a mesh's follows from its rate.
        filled = {**row, "modes": row["junctions"] if row.get("renderer") == "modal" else None}
        what = ", ".join(f"{key} {filled[key]}" for key in ABOUT[part, name] if filled[key] is not None)
        assert f"{part} {what}" not in rows, f"two rows of {part} are about {what}"
        rows[f"{part} {what}"] = row
    return rows


def _pairs(new: dict[str, Any], old: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    for part, name in ABOUT:
        before, after = _rows(old, part, name), _rows(new, part, name)
        for what in before.keys() & after.keys():
            yield what, _flat(before[what]), _flat(after[what])
    one, other = (found.get("effects", {}).get("none") for found in (old, new))
    if one and other:  # its ratio is to what is written by hand
        yield "effects none", {"ratio": one["over_by_hand"]}, {"ratio": other["over_by_hand"]}


def lost(new: dict[str, Any], old: dict[str, Any]) -> list[str]:
    """Rows that only the old result has."""
    return [what for each in ABOUT for what in _rows(old, *each) if what not in _rows(new, *each)]


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    # The row with what is inside of it told beside it: how far the phases of the tick are from the design.
    given = row.get("restitution")
    if given is None:
        return row
    off = {f"restitution_{key}": None if given[key] is None else given[key] - row["design"] for key in SPREAD}
    return row | off


def _grew(key: str, before: float, after: float) -> bool:
    if key.endswith("_dB"):
        return after > before + ROUNDING_DB
    if key == "energy":  # less than nothing is no fault
        return max(after, 0.0) > GREW * max(before, 0.0) + ROUNDING_ENERGY
    return abs(after) > GREW * abs(before) + ROUNDING


def changes(new: dict[str, Any], old: dict[str, Any], by: float) -> tuple[list[Change], list[Change]]:
    """Numbers that got worse, and those that got better."""
    worse: list[Change] = []
    better: list[Change] = []
    for what, before, after in _pairs(new, old):
        if (
            before.get("measured", True)
            and after.get("measured", True)
            and None not in (before["ratio"], after["ratio"])
        ):
            change = Change(what, "cost over the yardstick", before["ratio"], after["ratio"])
            most = COMPOSED_BY if what == "effects none" else by
            if after["ratio"] > most * before["ratio"]:
                worse.append(change)
            elif before["ratio"] > most * after["ratio"]:
                better.append(change)
        for key in GAINS:
            one, other = before.get(key), after.get(key)
            if one is None or key not in after or one == other:
                continue
            change = Change(what, key, one, float("nan") if other is None else other)
            slack = 1.0 if key == "modes_found" else GREW
            if other is None or one > slack * other:
                worse.append(change)
            elif other > slack * one:
                better.append(change)
        for key in PROMISES:
            if before.get(key) != after.get(key) and key in after:
                (better if after[key] else worse).append(Change(what, key, before[key], after[key]))
        for key in ERRORS:
            one, other = before.get(key), after.get(key)
            if one is None or other is None:
                if one is not None and key in after:
                    worse.append(Change(what, f"{key}, now none", one, float("nan")))
                continue
            if _grew(key, one, other):
                worse.append(Change(what, key, one, other))
            elif _grew(key, other, one):
                better.append(Change(what, key, one, other))
    return worse, better


def changes_of_sets(new: Path, old: Path, by: float) -> tuple[int, list[Change], list[Change]]:
    """Compare two folders of results: how many ratios both have, those that got worse, and those that got better."""
    compared, worse, better = 0, [], []
    for name in RATIOS:
        files = [folder / f"{name}.json" for folder in (old, new)]
        if not all(file.exists() for file in files):
            continue
        before, after = (ratios(name, stored.read_file(file)) for file in files)
        for what in before.keys() & after.keys():
            (one, is_gain), (other, _) = before[what], after[what]
            compared += 1
            grew = one / other if is_gain else other / one
            if not 1.0 / by <= grew <= by:
                (worse if grew > by else better).append(Change(name, what, one, other))
    return compared, sorted(worse), sorted(better)


def _tell(compared: int, worse: list[Change], better: list[Change]) -> None:
    for title, found in (("worse", worse), ("better", better)):
        print(
            f"{title}: {len(found)} of {compared} rows" if found else f"{title}: nothing of {compared} rows"
        )
        for change in found:
            print(f"  {change.words()}")


def _of_sets(new: Path, old: Path, by: float) -> int:
    compared, worse, better = changes_of_sets(new, old, by)
    _tell(compared, worse, better)
    both = [folder / "accuracy.json" for folder in (new, old)]
    if all(file.exists() for file in both):
        print("accuracy:")
        return max(_of_accuracy(*map(stored.read_file, both), by), 1 if worse else 0)
    if not compared:
        print("nothing to compare: no ratio is in both", file=sys.stderr)
        return 2
    return 1 if worse else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("new", type=Path)
    parser.add_argument("old", type=Path, nargs="?")
    parser.add_argument("--by", type=float, default=1.3)
    given = parser.parse_args()
    if given.new.is_dir():
        return _of_sets(given.new, given.old or RESULTS, given.by)
    return _of_accuracy(
        stored.read_file(given.new), shipped() if given.old is None else stored.read_file(given.old), given.by
    )


def _of_accuracy(new: dict[str, Any], old: dict[str, Any], by: float) -> int:
    compared = sum(1 for _ in _pairs(new, old))
    if not compared:
        print("nothing to compare: no row is in both", file=sys.stderr)
        return 2
    gone = lost(new, old)
    alike = new["machine"]["quick"] == old["machine"]["quick"]
    if not alike:
        print(
            "one of the two is a quick run: its means are of fewer cases, and differ a little for that alone"
        )
    if gone:
        print(f"not compared: {len(gone)} rows that only the old result has")
        if alike:
            print("\n".join(f"  {what}" for what in gone))
    worse, better = changes(new, old, by)
    _tell(compared, worse, better)
    return 1 if worse or (alike and gone) else 0


if __name__ == "__main__":
    sys.exit(main())
