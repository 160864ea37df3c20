"""Time of `make test` by layer, and its false alarms: drumstick lab suite [--runs 1] [--busy [COMMAND]].

Runs `make test` so many times in this checkout, one after another; --busy: beside a process that keeps one core busy,
by counting, or by a command that has work for longer than a run and may be interrupted (`drumstick lab mutation`).
Each run is kept as it ends, with its commit, seconds by layer, and the names of what failed: lab/results/suite.json.
Runs of other commits stay there: those of a whole history tell more about false alarms than twenty of one day. What a
red run printed is in .pytest_cache.
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
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)")
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


def _run(busy: Sequence[str] | None) -> dict[str, Any]:
    neighbour = None if busy is None else subprocess.Popen(busy, stdout=subprocess.DEVNULL)
    busy_to_the_end = False
    begun = time.monotonic()
    try:
        done = subprocess.run(
            ["make", "test"], cwd=ROOT, env=dict(os.environ, CI="true"), capture_output=True, text=True, check=False
        )  # fmt: skip
    finally:
        if neighbour is not None:
            busy_to_the_end = neighbour.poll() is None
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
    whole_s = time.monotonic() - begun
    ended = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    if done.returncode != 0:
        SAID.mkdir(exist_ok=True)
        (SAID / f"red-{ended}.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
    return {
        "commit": commit.stdout.strip() + ("" if same else "-dirty"),
        "ended": ended,
        "beside_a_busy_core": busy_to_the_end,
        "passed": done.returncode == 0,
        "whole_s": round(whole_s, 1),
        **read_output(done.stdout, whole_s),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1)
    words = "keep one core busy meanwhile, by this command or by counting"
    parser.add_argument("--busy", nargs="?", const=COUNTING, metavar="COMMAND", help=words)
    given = parser.parse_args()
    busy = None if given.busy is None else shlex.split(given.busy)
    for _ in range(given.runs):
        run = _run(busy)
        kept = stored.read("suite")["runs"] if stored.exists("suite") else []
        stored.store("suite", {"runs": [*kept, run]})
        PAGE.write_text(page(), encoding="utf-8")  # the next run looks whether it is up to date
        print(json.dumps(run))


if __name__ == "__main__":
    main()
