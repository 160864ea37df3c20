"""docs/venue.md, step by step on three machines: each command is run, and what it is said to show is looked for.

A block's first line names the machine, `home` for the one with the authority's key, and `stays` for what is left
running. A block of `text` behind it is what is seen: lines, with … for anything.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from hosts import environment, require_root
from rig_process import DRUMSTICK, PATIENCE_S, wait_for
from three_hosts import Running, ThreeHosts

pytestmark = [pytest.mark.system, pytest.mark.long, pytest.mark.real_clock, pytest.mark.timeout(1800)]
GUIDE = Path(__file__).parents[2] / "docs" / "venue.md"
_BLOCK = re.compile(r"^( *)```(sh|text)(?: (\w+))?( stays)?\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
_CARRIED = {"haptic": ("haptic",), "sound": ("sound",), "panel": ("panel", "technician")}


class Step(NamedTuple):
    """One block of commands, and the lines that it is said to show."""

    machine: str
    stays: bool
    commands: str
    seen: tuple[str, ...]


def steps(text: str) -> list[Step]:
    found: list[Step] = []
    for indent, kind, machine, stays, body in _BLOCK.findall(text):
        lines = "\n".join(line.removeprefix(indent) for line in body.splitlines())
        if kind == "sh":
            found.append(Step(machine, bool(stays), lines, ()))
        else:
            found[-1] = found[-1]._replace(seen=tuple(lines.splitlines()))
    return [step for step in found if step.machine]


def shows(said: str, line: str) -> bool:
    """True when what was said has this line somewhere."""
    words = ".*".join(re.escape(part) for part in line.split("…"))
    return re.search(words, said) is not None


@pytest.fixture
def venue(tmp_path: Path) -> Iterator[ThreeHosts]:
    require_root()
    made = ThreeHosts(tmp_path)
    try:
        yield made
    finally:
        made.close()


def test_the_guide_has_its_steps() -> None:
    found = steps(GUIDE.read_text(encoding="utf-8"))
    assert [step.machine for step in found if step.stays] == ["haptic", "sound", "panel"]
    assert len(found) > 10
    assert sum(bool(step.seen) for step in found) > 8


def test_every_step_of_the_guide_does_what_it_says(venue: ThreeHosts, tmp_path: Path) -> None:
    commands = tmp_path / "bin"
    commands.mkdir()
    (commands / "drumstick").write_text(f"#!/bin/sh\nexec {DRUMSTICK[0]} -c '{DRUMSTICK[2]}' \"$@\"\n")
    (commands / "drumstick").chmod(0o755)
    for step in steps(GUIDE.read_text(encoding="utf-8")):
        home = tmp_path if step.machine == "home" else tmp_path / step.machine
        own = dict(environment(home / "home"))
        own["PATH"] = f"{commands}:{own['PATH']}"
        if step.machine == "home":
            said = _done(["sh", "-euc", step.commands], home, own)
            for machine, folders in _CARRIED.items():
                for name in folders:
                    shutil.copytree(home / "keys" / name, home / machine / name)
        elif step.stays:
            command = ["sh", "-c", f"exec {step.commands}"]
            program = Running(venue.venue[step.machine], command, home, own)
            venue.running[step.machine] = program
            wait_for(
                f"{step.seen} of {step.commands}",
                lambda program=program, step=step: (
                    program.process.poll() is not None or all(shows(program.said, s) for s in step.seen)
                ),
            )
            said = program.said
        elif "doctor" in step.commands:  # changes nothing; who came in last may not be seen yet
            command = [*venue.venue[step.machine].enter, "sh", "-euc", step.commands]
            said, end = _done(command, home, own), time.monotonic() + PATIENCE_S
            while not all(shows(said, line) for line in step.seen) and time.monotonic() < end:
                said = _done(command, home, own)
        else:
            said = _done([*venue.venue[step.machine].enter, "sh", "-euc", step.commands], home, own)
        missing = [line for line in step.seen if not shows(said, line)]
        others = "\n".join(program.said for program in venue.running.values())
        assert missing == [], f"{step.machine}: {step.commands}\n{said}\nThe services said:\n{others}"
    for machine in ("panel", "sound", "haptic"):
        assert venue.running.pop(machine).stop() == 0


def _done(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout + done.stderr
