"""Matrix of tests and mutants: a mutant's tests run to the end, and each function of them noticed it or did not.

A function that notices nothing is a question, not a verdict: it may hold what no mutant of these modules can break.
"""

import contextlib
import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drumstick_lab.benchmarks.mutants.mutation_mutants import Mutant
from drumstick_lab.benchmarks.mutants.mutation_trials import NOT_COMPILED, Copy


def fill(mutants: Sequence[Mutant], tests: Mapping[str, Sequence[str]], copy: Copy, rows: Path) -> None:
    """Try each mutant that `rows` does not have yet, and append its row. Ctrl-C ends it."""
    have = {(row["where"], *row["diff"]) for row in _read(rows)}
    todo = [each for each in mutants if (each.where, *each.diff) not in have]
    print(f"{len(todo)} of {len(mutants)} mutants to try.", flush=True)
    with contextlib.suppress(KeyboardInterrupt), rows.open("a", encoding="utf-8") as file:
        for each in todo:
            verdict, failed = copy.outcomes(each.path, each.source, tests[each.module])
            row: dict[str, Any] = {"module": each.module, "where": each.where, "diff": each.diff}
            row |= {"fate": verdict.fate, "seconds": round(verdict.seconds, 1), "failed": failed}
            print(json.dumps(row), file=file, flush=True)
            print(
                f"{verdict.fate:12} {verdict.seconds:6.1f} s  {each.where}  by {sum(failed.values())}",
                flush=True,
            )


def table(rows: Path) -> dict[str, Any]:
    """By file and function: mutants that it saw, that it noticed, and that nothing else noticed."""
    counts: defaultdict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
    mutants: defaultdict[str, int] = defaultdict(int)
    for row in _read(rows):
        if row["fate"] == NOT_COMPILED or not row["failed"]:
            continue
        mutants[row["module"]] += 1
        alone = sum(row["failed"].values()) == 1
        for function, failed in row["failed"].items():
            seen = counts[function]
            seen[0] += 1
            seen[1] += failed
            seen[2] += failed and alone
    files: defaultdict[str, dict[str, list[int]]] = defaultdict(dict)
    for name in sorted(counts):
        file, _, function = name.partition("::")
        files[file][function] = counts[name]
    return {"mutants": mutants, "columns": ["seen", "noticed", "noticed_alone"], "tests": files}


def _read(rows: Path) -> list[dict[str, Any]]:
    """The rows of an earlier run; its last may be torn."""
    found: list[dict[str, Any]] = []
    for line in rows.read_text(encoding="utf-8").splitlines() if rows.exists() else []:
        with contextlib.suppress(ValueError):
            found.append(json.loads(line))
    return found
