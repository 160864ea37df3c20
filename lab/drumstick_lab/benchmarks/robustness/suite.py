"""Time of `make test` by layer, and its false alarms: drumstick lab suite [--runs 1] [--busy [COMMAND]] [--cold] [--slice N].

Runs `make test` so many times in this checkout, one after another, each to its end whatever is red. --busy: beside a
process that keeps one core busy, by counting, or by a command that has work for longer than a run, may be
interrupted and leaves this checkout alone (`drumstick lab mutation` in another one). --cold: with no kernel compiled. --slice: and then a fifth of the long tests, as
CI does. Each run is kept as it ends, with its commit, seconds by layer, and the names of what failed:
lab/results/suite.json. Runs of other commits stay there: those of a whole history tell more about false alarms than
twenty of one day. What a red run printed is in .pytest_cache.
"""

import argparse
import datetime
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from typing import Any

from drumstick_lab.checkout import ROOT
from drumstick_lab.measuring import stored
from drumstick_lab.pages.measured.measured_page import PAGE, page

SAID = ROOT / ".pytest_cache"  # of red runs, whole
LAYERS = ("computing", "processes", "real clock")  # the passes of `make test`, in order
COUNTING = f"{sys.executable} -c 'while True: pass'"
# The end of a pass, also of one in which nothing passed: it keeps its place among the others.
_PASS = re.compile(r"^=+ (?:.*?(\d+) passed|.*\b(?:failed|errors?)\b).* in ([\d.]+)s")
_FAILED = re.compile(r"^(?:FAILED|ERROR) (tests/\S+?\[.*?\]|tests/\S+)(?: - |$)")
_IGNORED = re.compile(
    r"^make.*Error \d+ \(ignored\)$", re.MULTILINE
)  # a step that failed, before make went on
_PATIENCE_S = 60.0  # with a neighbour that is to end
_RERUN = re.compile(r"(\d+) rerun")


def read_output(text: str, whole_s: float) -> dict[str, Any]:
    """Seconds and tests by layer, and what failed, as `make test` printed it; what is no pass of pytest is "checks"."""
    lines = text.splitlines()
    passes = [found for line in lines if (found := _PASS.match(line))]
    seconds = {name: float(found[2]) for name, found in zip(LAYERS, passes, strict=False)}
    return {
        "seconds": {"checks": round(whole_s - sum(seconds.values()), 1), **seconds},
        "tests": {name: int(found[1] or 0) for name, found in zip(LAYERS, passes, strict=False)},
        "failed": [found[1] for line in lines if (found := _FAILED.match(line))],
        "reruns": sum(
            int(found[1]) for line in lines if _PASS.match(line) and (found := _RERUN.search(line))
        ),
    }


def is_green(status: int, said: str, complaints: str) -> bool:
    """Did make and all its steps succeed? By its status, by what it said (in English), and by what pytest named."""
    failed = any(_FAILED.match(line) for line in said.splitlines())
    return status == 0 and not _IGNORED.search(complaints) and not failed


def _end(neighbour: subprocess.Popen[bytes]) -> bool:
    # True if it had been at work to the end.
    was_busy = neighbour.poll() is None
    neighbour.send_signal(signal.SIGINT)
    try:
        neighbour.wait(_PATIENCE_S)
    except subprocess.TimeoutExpired:  # what a shell puts into its background ignores that
        neighbour.kill()
        neighbour.wait()
    return was_busy


def _version() -> str:
    # What the runs before stored, and the page made of it, make no other tree.
    others = [f":!{each.relative_to(ROOT)}" for each in (stored.path("suite"), PAGE)]
    same = subprocess.run(["git", "diff", "--quiet", "HEAD", "--", ".", *others], cwd=ROOT, check=False)
    commit = subprocess.run(
        ["git", "describe", "--always"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return commit.stdout.strip() + ("-dirty" if same.returncode else "")


def _made(environment: dict[str, str], *goal: str) -> tuple[float, subprocess.CompletedProcess[str]]:
    begun = time.monotonic()
    done = subprocess.run(
        ["make", "--ignore-errors", *goal], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )  # fmt: skip
    return time.monotonic() - begun, done


def _run(busy: Sequence[str] | None, cold: str | None, part: str | None) -> dict[str, Any]:
    environment = dict(os.environ, CI="true", LC_ALL="C.UTF-8", LANGUAGE="") | (
        {} if cold is None else {"XDG_CACHE_HOME": cold}
    )
    subprocess.run(["make", "install-dev"], cwd=ROOT, env=environment, stdout=subprocess.DEVNULL, check=True)
    commit = _version()
    neighbour = None if busy is None else subprocess.Popen(busy, stdout=subprocess.DEVNULL)
    was_busy = False
    try:
        whole_s, done = _made(environment, "test")
        all_done = [done]
        found = read_output(done.stdout, whole_s)
        if part is not None:
            spent_s, done = _made(environment, "test-long", f"SLICE={part}")
            all_done.append(done)
            long = read_output(done.stdout, spent_s)
            found["seconds"][f"long, slice {part}"] = round(spent_s, 1)
            found["failed"] += long["failed"]
            found["reruns"] += long["reruns"]
    finally:
        if neighbour is not None:
            was_busy = _end(neighbour)
    if neighbour is not None and not was_busy:
        print(
            f"{shlex.join(busy or ())} ended before the tests did: this run counts as one on a quiet machine"
        )
    passed = all(is_green(each.returncode, each.stdout, each.stderr) for each in all_done)
    ended = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    if not passed:
        SAID.mkdir(exist_ok=True)
        said = "".join(each.stdout + each.stderr for each in all_done)
        (SAID / f"red-{ended}.txt").write_text(said, encoding="utf-8")
    return {
        "commit": commit,
        "ended": ended,
        "beside_a_busy_core": was_busy,
        "cold": cold is not None,
        "passed": passed,
        "whole_s": round(sum(found["seconds"].values()), 1),
        **found,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1)
    words = "keep one core busy meanwhile, by this command or by counting"
    parser.add_argument("--busy", nargs="?", const=COUNTING, metavar="COMMAND", help=words)
    parser.add_argument("--cold", action="store_true", help="begin without a compiled kernel")
    parser.add_argument(
        "--slice", choices=("0", "1", "2", "3", "4"), help="then this fifth of the long tests"
    )
    given = parser.parse_args()
    busy = None if given.busy is None else shlex.split(given.busy)
    for _ in range(given.runs):
        with tempfile.TemporaryDirectory() as empty:
            run = _run(busy, empty if given.cold else None, given.slice)
        kept = stored.read("suite")["runs"] if stored.exists("suite") else []
        stored.store("suite", {"runs": [*kept, run]})
        PAGE.write_text(page(), encoding="utf-8")  # the next run looks whether it is up to date
        print(json.dumps(run))


if __name__ == "__main__":
    main()
