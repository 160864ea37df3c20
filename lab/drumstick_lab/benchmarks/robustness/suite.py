"""Time of `make test` by layer, and its false alarms: drumstick lab suite [--runs 1] [--busy [COMMAND]] [--cold] [--slice N].

Runs `make test` so many times in this checkout, one after another, each to its end whatever is red. --busy: beside a
process that keeps one core busy, by counting, or by a command that has work for longer than a run and may be
interrupted (`drumstick lab mutation`). --cold: with no kernel compiled. --slice: and then a fifth of the long tests, as
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
_PASS = re.compile(r"^=+ .*?(\d+) passed.* in ([\d.]+)s")
_FAILED = re.compile(r"^(?:FAILED|ERROR) (tests/.+?)(?: - .*)?$")
_IGNORED = "(ignored)"  # what make says of a step that failed, and goes on
_RERUN = re.compile(r"(\d+) rerun")


def read_output(text: str, whole_s: float) -> dict[str, Any]:
    """Seconds and tests by layer, and what failed, as `make test` printed it; what is no pass of pytest is "checks"."""
    lines = text.splitlines()
    passes = [found for line in lines if (found := _PASS.match(line))]
    seconds = {name: float(found[2]) for name, found in zip(LAYERS, passes, strict=False)}
    return {
        "seconds": {"checks": round(whole_s - sum(seconds.values()), 1), **seconds},
        "tests": {name: int(found[1]) for name, found in zip(LAYERS, passes, strict=False)},
        "failed": [found[1] for line in lines if (found := _FAILED.match(line))],
        "reruns": sum(
            int(found[1]) for line in lines if _PASS.match(line) and (found := _RERUN.search(line))
        ),
    }


def _made(environment: dict[str, str], *goal: str) -> tuple[float, subprocess.CompletedProcess[str]]:
    begun = time.monotonic()
    done = subprocess.run(
        ["make", "--ignore-errors", *goal], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )  # fmt: skip
    return time.monotonic() - begun, done


def _run(busy: Sequence[str] | None, cold: str | None, part: str | None) -> dict[str, Any]:
    environment = dict(os.environ, CI="true") | ({} if cold is None else {"XDG_CACHE_HOME": cold})
    neighbour = None if busy is None else subprocess.Popen(busy, stdout=subprocess.DEVNULL)
    try:
        whole_s, done = _made(environment, "test")
        all_done = [done]
        found = read_output(done.stdout, whole_s)
        if part is not None:
            spent_s, done = _made(environment, "test-long", f"SLICE={part}")
            all_done.append(done)
            found["seconds"][f"long, slice {part}"] = round(spent_s, 1)
            found["failed"] += read_output(done.stdout, spent_s)["failed"]
    finally:
        if neighbour is not None:
            if neighbour.poll() is not None:
                print(
                    f"{shlex.join(neighbour.args)} ended before the tests did: the core was not busy to the end"
                )
            neighbour.send_signal(signal.SIGINT)
            neighbour.wait()
    commit = subprocess.run(
        ["git", "describe", "--always"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    # What the runs before stored, and the page made of it, make no other tree.
    others = [f":!{each.relative_to(ROOT)}" for each in (stored.path("suite"), PAGE)]
    same = (
        subprocess.run(
            ["git", "diff", "--quiet", "HEAD", "--", ".", *others], cwd=ROOT, check=False
        ).returncode
        == 0
    )
    passed = all(each.returncode == 0 and _IGNORED not in each.stderr for each in all_done)
    ended = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    if not passed:
        SAID.mkdir(exist_ok=True)
        said = "".join(each.stdout + each.stderr for each in all_done)
        (SAID / f"red-{ended}.txt").write_text(said, encoding="utf-8")
    return {
        "commit": commit.stdout.strip() + ("" if same else "-dirty"),
        "ended": ended,
        "beside_a_busy_core": neighbour is not None,
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
