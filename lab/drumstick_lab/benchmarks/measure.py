"""Every stored result from one run: drumstick lab measure [NAME ...] [--all] [--list] [--again] [--out DIR].

The programs that store results run one after the other, each a process of its own. One whose result is already of this
version and this machine is left out, so the same command goes on where it was stopped; --again measures it anyway. How
long all will take is told beforehand, by what each took the last time. One that fails does not stop the others: its last
lines are told at the end, and the exit status is 1. --list: all results, how long, and what state they are in. Some are
made by hand only, since they take hours or need files from elsewhere. --out: store in another folder, so that what
`lab/results` holds stays; `drumstick lab worse DIR` compares the two. Do nothing else on the machine meanwhile.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from drumstick_lab import checkout
from drumstick_lab.checkout import OTHER_RESULTS, ROOT
from drumstick_lab.measuring import stored
from drumstick_lab.measuring.catalogue import CATALOGUE
from drumstick_lab.measuring.provenance import is_of_these_sources, machine_of
from drumstick_lab.measuring.this_machine import description
from drumstick_lab.programs import module_of

_LAST_LINES = 12
_LONGEST_S, _TIMES_LONGER = 900.0, 4.0  # a program that takes longer than both hangs
_END_S = 20.0


def state(name: str) -> str:
    """`done`, or why the result has to be measured."""
    if not stored.exists(name):
        return "not stored"
    machine = stored.read(name).get("machine", {})
    if machine_of(machine) != machine_of(description()):
        return "from another machine"
    found = is_of_these_sources(name, machine)
    return "version not known" if found is None else "done" if found else "stale"


def expected_s(name: str) -> float:
    """Seconds that it took the last time, or about as many; the estimate where it is told when to stop."""
    if "--minutes" in CATALOGUE[name].arguments:
        return CATALOGUE[name].about_s
    for path in (stored.path(name), ROOT / "lab" / "results" / f"{name}.json"):
        if path.exists() and (took := stored.read_file(path).get("machine", {}).get("elapsed_s")) is not None:
            return float(took)
    return CATALOGUE[name].about_s


def command_of(name: str) -> list[str]:
    """Words of its process."""
    program = CATALOGUE[name].started_by(name)[1]
    return [sys.executable, "-m", module_of(program), *CATALOGUE[name].arguments]


def _run(command: list[str], said: Path, limit_s: float) -> str:
    """Run a program; returns why it failed, or nothing."""
    with said.open("wb") as file, subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT, start_new_session=True
    ) as process:  # fmt: skip
        try:
            status = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            return f"ended after {limit_s:.0f} s"
        finally:
            _end(process)
    return f"exit status {status}" if status else ""


def _end(process: "subprocess.Popen[bytes]") -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGINT)  # so that it ends the rig that it started
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)


def measure(names: Iterable[str], say: Callable[[str], None]) -> dict[str, str]:
    """Run each program in turn; why it failed and its last lines, for those that did."""
    failed: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="drumstick-measure-") as folder:
        for name in names:
            expected, begun, said = expected_s(name), time.monotonic(), Path(folder) / name
            say(f"{name}: about {expected:.0f} s")
            why = _run(command_of(name), said, max(_LONGEST_S, _TIMES_LONGER * expected))
            if not why and state(name) != "done":
                why = f"it ended well, but its result is: {state(name)}"
            say(f"{name}: {why or 'stored'}, {time.monotonic() - begun:.0f} s")
            if why:
                last = said.read_text(encoding="utf-8", errors="replace").splitlines()[-_LAST_LINES:]
                failed[name] = "\n".join([why, *(f"  {each}" for each in last)])
    return failed


def _list() -> None:
    for name, entry in CATALOGUE.items():
        started = f"  by hand: {entry.by_hand}" if entry.by_hand else ""
        print(f"{name:24s}{expected_s(name) / 60.0:6.1f} min  {state(name):22s}{started}")


def _asked(parser: argparse.ArgumentParser, names: list[str], every: bool) -> list[str]:
    if every:
        return [name for name, entry in CATALOGUE.items() if not entry.by_hand]
    for name in names:
        if name not in CATALOGUE:
            parser.error(f"{name}: no result has that name; --list shows them")
        if CATALOGUE[name].by_hand:
            parser.error(f"{name}: by hand only: {CATALOGUE[name].by_hand}")
    return names


def main(words: list[str] | None = None) -> int:
    """Measure what is asked for; the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME", type=lambda name: name.replace("-", "_"))
    parser.add_argument("--all", action="store_true", help="all that are not made by hand")
    parser.add_argument("--list", action="store_true", help="measure nothing; exit status 0")
    parser.add_argument("--again", action="store_true", help="also what is of this version and machine")
    parser.add_argument("--out", type=Path, help="store in this folder instead of lab/results")
    given = parser.parse_args(words)
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
        checkout.RESULTS = given.out.resolve()
        os.environ[OTHER_RESULTS] = str(checkout.RESULTS)  # for the programs
    asked = _asked(parser, given.names, given.all)
    if given.list or not asked:
        _list()
        return 0
    todo = [name for name in asked if given.again or state(name) != "done"]
    minutes = sum(map(expected_s, todo)) / 60.0
    print(
        f"{len(todo)} to measure, {len(asked) - len(todo)} are done; about {minutes:.0f} minutes", flush=True
    )
    failed = measure(todo, lambda words: print(words, flush=True))
    for name, why in failed.items():
        print(f"FAILED {name}: {why}")
    if todo and given.out is None:
        print("Now: drumstick lab measured-page, and the other pages that are made of results")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
