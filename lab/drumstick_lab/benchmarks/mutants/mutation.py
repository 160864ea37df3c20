"""Mutation score of the tests: share of wrong programs that they notice.

drumstick lab mutation [--count 200] [--seed 1] [--only NAME]

Stores lab/results/mutation.json. Of every mutant of the modules in TARGETS (one operator, comparison, number,
call ... changed, by poodle's mutators: mutation_mutants.py) some are drawn by the seed, and each must make one of its
module's tests fail. What is tried is the commit at HEAD, in copies of the tree (mutation_trials.py). Verdicts are kept
as they come: stop it whenever you like, it goes on from there. On another commit a mutant that was killed stays killed
as long as its module and all that it imports are the same; a survivor is tried again. --fresh forgets all that;
--report only stores what is known so far. --survivors tries those of the stored result once more, with the tests of now,
and leaves the rest of it as it is: for when tests came and the code stayed, or only moved.

--matrix asks which tests notice nothing: it runs a mutant's tests to the end, all or those in some folders and files,
and stores lab/results/mutation_tests.json (mutation_matrix.py), of as many mutants as were tried when it is stopped.

A mutant that changes nothing that a test could see does not count: say so, with the reason, in mutation_equivalent.py.
Nor does one that numba does not compile. By hand only: a mutated kernel compiles anew, and with it all that calls it.
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from drumstick_lab.benchmarks.mutants.mutation_equivalent import reason_of
from drumstick_lab.benchmarks.mutants.mutation_matrix import fill, table
from drumstick_lab.benchmarks.mutants.mutation_mutants import Mutant, drawn, mutants_of
from drumstick_lab.benchmarks.mutants.mutation_trials import (
    KILLED,
    NOT_COMPILED,
    SURVIVED,
    TIMED_OUT,
    Copy,
    Imports,
    Verdict,
    commit,
    stored_verdicts,
    uncommitted,
)
from drumstick_lab.measuring import stored

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "haptic-drumstick-mutation"
GOAL = 0.85

_HELD = "tests/stability/servo/test_held_arm.py"
_LIVE = "tests/stability/servo/test_live_sets.py"
_ANY = "tests/stability/stick/test_any_parameters.py::test_no_contact_exceeds_what_the_envelope_predicts"
_DOOR = "tests/unit/protocol/access/test_roles_at_the_door.py"
# Which files, and which tests of them: what fails soonest first.
TARGETS: dict[str, tuple[Sequence[str], Sequence[str]]] = {
    "envelope": (
        ["shared/drumstick/safety/envelope.py"],
        [
            "tests/unit/drumstick/safety/test_envelope_borders.py", "tests/unit/drumstick/safety/test_envelope.py", "tests/unit/drumstick/safety/test_envelope_on_an_arm.py",
            "tests/unit/haptic_server/servo/force/test_rendering.py",
            "tests/unit/haptic_server/servo/test_servo.py", _HELD, _LIVE,
        ],
    ),
    "sampled": (
        ["shared/drumstick/safety/sampled_contact.py"],
        [
            "tests/unit/drumstick/safety/test_sampled_contact.py",
            "tests/unit/drumstick/safety/test_envelope_on_an_arm.py", "tests/unit/drumstick/safety/test_envelope.py",
            "tests/unit/haptic_server/servo/force/test_rendering.py", _HELD, _LIVE,
        ],
    ),
    "bounds": (
        ["shared/drumstick/safety/bounds.py", "shared/drumstick/safety/contact_bounds.py"],
        [
            "tests/unit/drumstick/safety/test_bounds_by_hand.py", "tests/unit/drumstick/safety/test_bounds.py", "tests/unit/drumstick/safety/test_envelope.py", _ANY, _LIVE,
        ],
    ),
    "guard": (
        ["services/haptic_server/servo/force/guard.py"],
        ["tests/unit/haptic_server/servo/force/test_guard.py",
         "tests/unit/haptic_server/servo/force/test_rendering.py", "tests/unit/haptic_server/test_fences.py", _HELD, _LIVE],
    ),
    "fence": (
        ["shared/drumstick/safety/fence.py"],
        ["tests/unit/drumstick/safety/test_servo_fence.py", "tests/unit/haptic_server/test_fences.py",
         "tests/unit/haptic_server/servo/test_servo.py", _LIVE],
    ),
    "latch": (
        ["services/haptic_server/servo/force/latch.py"],
        ["tests/unit/haptic_server/servo/test_servo.py", "tests/unit/haptic_server/test_fences.py",
         "tests/unit/haptic_server/servo/force/test_rendering.py", _LIVE],
    ),
    "panel": (
        ["services/web_panel/access/viser_access.py", "services/web_panel/access/admission.py",
         "services/web_panel/access/client_message.py"],
        [
            "tests/unit/web_panel/access/test_admission.py", "tests/unit/web_panel/access/test_client_message.py",
            "tests/unit/web_panel/access/test_viser_access.py",
            "tests/system/test_panel_door.py",
        ],
    ),
    "roles": (
        ["shared/protocol/access/rules.py", "shared/protocol/access/roles.py", "shared/protocol/access/router.py"],
        [
            "tests/unit/protocol/access/test_access.py", "tests/contract/test_router_files.py",
            "tests/unit/rig/identity/test_keys.py", "tests/unit/rig/supervision/test_resolved_options.py",
            "tests/unit/rig/network/test_remote_rig.py", _DOOR,
            "tests/system/test_router_files.py",
        ],
    ),
    "lease": (
        ["services/haptic_server/gateway/lease.py"],
        ["tests/unit/haptic_server/gateway/test_lease.py", "tests/unit/haptic_server/presets/test_presets_and_settings.py"],
    ),
}  # fmt: skip


def _id(mutant: Mutant, imports: Imports) -> str:
    whole = "\0".join((mutant.path, mutant.source, imports.below(mutant.path)))
    return hashlib.sha256(whole.encode()).hexdigest()[:24]


@dataclass
class Run:
    """The mutants drawn and their verdicts. `lock` guards `verdicts` and the file that keeps them."""

    mutants: list[Mutant]
    imports: Imports
    kept: Path
    head: str
    verdicts: dict[str, Verdict]
    lock: threading.Lock = field(default_factory=threading.Lock)

    def ids(self) -> Iterator[tuple[Mutant, str]]:
        for mutant in self.mutants:
            yield mutant, _id(mutant, self.imports)

    def open(self, only: Sequence[str]) -> list[tuple[Mutant, str]]:
        return [
            (mutant, ident)
            for mutant, ident in self.ids()
            if reason_of(mutant) is None and mutant.module in only and not self._settled(ident)
        ]

    def _settled(self, ident: str) -> bool:
        verdict = self.verdicts.get(ident)
        return verdict is not None and (verdict.fate != SURVIVED or verdict.commit == self.head)

    def keep(self, ident: str, verdict: Verdict) -> None:
        with self.lock, self.kept.open("a", encoding="utf-8") as file:
            self.verdicts[ident] = verdict
            file.write(json.dumps({"mutant": ident, **asdict(verdict)}) + "\n")


def work(run: Run, copy: Copy, waiting: SimpleQueue[tuple[Mutant, str]], stop: threading.Event) -> None:
    while not stop.is_set():
        try:
            mutant, ident = waiting.get_nowait()
        except Empty:
            return
        verdict = copy.judge(mutant.path, mutant.source, TARGETS[mutant.module][1])
        if stop.is_set():
            return  # the tests were interrupted too
        run.keep(ident, Verdict(verdict.fate, verdict.by, round(verdict.seconds, 1), run.head))
        print(f"{verdict.fate:12} {verdict.seconds:6.1f} s  {mutant.where}  {verdict.by}", flush=True)
        if verdict.fate == SURVIVED:
            print("    " + "\n    ".join(mutant.diff), flush=True)


def score(fates: Counter[str]) -> float | None:
    killed = fates[KILLED] + fates[TIMED_OUT]
    counted = killed + fates[SURVIVED]
    return round(killed / counted, 4) if counted else None


def counts(run: Run, module: str | None = None) -> dict[str, Any]:
    """The stored row of all modules, or of one."""
    mine = [(mutant, ident) for mutant, ident in run.ids() if module in (None, mutant.module)]
    equal = [(mutant, reason) for mutant, _ in mine if (reason := reason_of(mutant)) is not None]
    tried = [(m, run.verdicts[i]) for m, i in mine if reason_of(m) is None and i in run.verdicts]
    fates = Counter(verdict.fate for _, verdict in tried)
    whole = len(tried) + len(equal) == len(mine)  # a part of the draw is no score
    row: dict[str, Any] = {"score" if whole else "score_of_those_tried": score(fates), "mutants": len(mine)}
    row |= {fate.replace(" ", "_"): fates[fate] for fate in (KILLED, TIMED_OUT, SURVIVED, NOT_COMPILED)}
    row |= {"equivalent": len(equal), "not_tried": len(mine) - len(equal) - len(tried)}
    row["minutes"] = round(sum(verdict.seconds for _, verdict in tried) / 60.0, 1)
    if module is not None:
        row["files"] = list(TARGETS[module][0])
        row["survivors"] = [_shown(mutant) for mutant, verdict in tried if verdict.fate == SURVIVED]
        row["equivalents"] = [_shown(mutant) | {"why": reason} for mutant, reason in equal]
    return row


def _shown(mutant: Mutant) -> dict[str, Any]:
    return {"where": mutant.where, "kind": mutant.kind, "diff": mutant.diff}


def prepared(head: str, workers: int, only: Sequence[str]) -> list[Copy]:
    """Copies of this commit in which every test of these modules passes, and whose kernels are compiled."""
    folder = CACHE / head
    first, passed = Copy(folder / "0"), folder / "passed"
    tests = sorted({test for module in only for test in TARGETS[module][1]})
    if not passed.exists() or passed.read_text(encoding="utf-8").split() != tests:
        for other in CACHE.glob("*/"):
            shutil.rmtree(other)
        first = Copy.fresh(folder / "0", head)
        verdict = first.passes(tests)
        if verdict.fate != SURVIVED:
            raise SystemExit(f"The tree as it is does not pass: {verdict.by}; see {folder}/0/said.txt")
        passed.write_text("\n".join(tests), encoding="utf-8")
        print(f"The tree as it is passes, in {verdict.seconds:.0f} s.", flush=True)
    first.restore()
    return [first, *(first.twin(folder / str(number)) for number in range(1, workers))]


def survivors_again(result: dict[str, Any], copy: Copy, only: Sequence[str]) -> None:
    """Try the stored result's survivors in these modules once more, and count anew. A file may have moved."""
    for module in only:
        row, left = result["modules"][module], []
        now = {
            (Path(each.path).name, *each.diff): each
            for path in TARGETS[module][0]
            for each in mutants_of(module, copy.tree, path)
        }
        for shown in row["survivors"]:
            file = Path(shown["where"].rpartition(":")[0]).name
            mutant = now.get((file, *shown["diff"]))
            if mutant is None:  # its line is another one today
                left.append(shown)
                continue
            if (reason := reason_of(mutant)) is not None:
                row["equivalents"].append(_shown(mutant) | {"why": reason})
                _count(result, row, "equivalent")
                continue
            verdict = copy.judge(mutant.path, mutant.source, TARGETS[module][1])
            print(f"{verdict.fate:12} {verdict.seconds:6.1f} s  {mutant.where}  {verdict.by}", flush=True)
            if verdict.fate == SURVIVED:
                left.append(_shown(mutant))
            else:
                _count(result, row, verdict.fate.replace(" ", "_"))
        row["survivors"] = left


def _count(result: dict[str, Any], row: dict[str, Any], fate: str) -> None:
    for counted in (row, result["all"]):
        counted["survived"] -= 1
        counted[fate] += 1
        killed = counted["killed"] + counted["timed_out"]
        counted["score"] = round(killed / (killed + counted["survived"]), 4)


def store(result: dict[str, Any]) -> None:
    """Keep the result, and print its scores."""
    stored.store("mutation", result)
    for module, row in (("all", result["all"]), *result["modules"].items()):
        print(f"{module:9}", {key: value for key, value in row.items() if not isinstance(value, list)})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--only", choices=TARGETS, nargs="+", default=list(TARGETS))
    parser.add_argument("--fresh", action="store_true", help="forget what was found before")
    parser.add_argument("--survivors", action="store_true", help="only those of the stored result, once more")
    parser.add_argument("--report", action="store_true", help="try nothing; store what was found so far")
    words = "which tests notice which mutants: all, or those whose path begins so"
    parser.add_argument("--matrix", nargs="*", help=words)
    given = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background has it ignored
    if uncommitted():
        print(f"Tried is the commit, without what is not committed in {', '.join(uncommitted())}.")
    head = commit()
    copies = (
        [Copy.fresh(CACHE / "report", head)] if given.report else prepared(head, given.workers, given.only)
    )
    if given.survivors:
        result = stored.read("mutation")
        survivors_again(result, copies[0], given.only)
        result["survivors_tried_again"] = {"commit": head, "modules": given.only}
        store(result)
        return
    tree, kept = copies[0].tree, CACHE / "verdicts.jsonl"
    if given.fresh:
        kept.unlink(missing_ok=True)
    every = {
        module: [each for path in files for each in mutants_of(module, tree, path)]
        for module, (files, _) in TARGETS.items()
    }
    chosen = drawn(every, given.count, given.seed)
    if given.matrix is not None:
        begins = tuple(given.matrix) or ("",)
        tests = {name: [test for test in of if test.startswith(begins)] for name, (_, of) in TARGETS.items()}
        asked = [name for name in given.only if tests[name]]
        mine = [each for each in chosen if each.module in asked and reason_of(each) is None]
        random.Random(given.seed).shuffle(mine)
        rows = CACHE / head / "matrix.jsonl"
        if not given.report:
            fill(mine, tests, copies[0], rows)
        stored.store("mutation_tests", {"commit": head} | table(rows))
        return
    run = Run(chosen, Imports(tree), kept, head, stored_verdicts(kept))
    todo = [] if given.report else run.open(given.only)
    random.Random(given.seed).shuffle(todo)  # so that a part of the run says something of all modules
    print(f"{len(chosen)} of {sum(map(len, every.values()))} mutants drawn, {len(todo)} to try.", flush=True)
    waiting: SimpleQueue[tuple[Mutant, str]] = SimpleQueue()
    for each in todo:
        waiting.put(each)
    stop = threading.Event()
    threads = [threading.Thread(target=work, args=(run, copy, waiting, stop)) for copy in copies]
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    except KeyboardInterrupt:
        stop.set()
        print("Stopping; the same command goes on from here.")
        for copy in copies:
            copy.stop()
        for thread in threads:
            thread.join()
    result = {"commit": run.head, "tool": f"poodle {version('poodle')}"}
    result |= {"seed": given.seed, "goal": GOAL, "possible": sum(map(len, every.values()))}
    result |= {"all": counts(run), "modules": {module: counts(run, module) for module in TARGETS}}
    store(result)


if __name__ == "__main__":
    main()
