"""A rerun after a stall of the host: with a rig of its own, since the first may have latched a fault."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# The stall is told, not made; the rig is latched as one that missed its ticks.
SUITE = """
import pytest
from haptic_server.servo import stall_detector

class ToldStall:
    refused = False
    def __enter__(self): return self
    def __exit__(self, *_): pass
    def stalls(self): return [(0, 15_000_000)] if told else []

stall_detector.StallDetector = ToldStall
told, started, ended = [], [], []

@pytest.fixture(scope="session")
def browser():
    print("browser started")

@pytest.fixture(scope="module")
def rig(browser):
    started.append("rig")
    rig = {"stalled": False, "number": len(started)}
    yield rig
    print("rig", rig["number"], "ended")
    ended.append(rig["number"])
    assert not (rig["stalled"] and BAD_END), "a rig in a fault ends with an error"

@pytest.mark.real_clock
def test_it_looks_on(rig):
    assert rig["number"] == 1

@pytest.mark.real_clock
def test_it_plays(rig):
    if not told:
        told.append("stall")
        rig["stalled"] = True
    assert not rig["stalled"]
    told.clear()
"""
LAST = """
@pytest.mark.real_clock
def test_its_neighbour_shares_the_new_one(rig):
    assert (rig["number"], ended) == (2, [1])
"""


@pytest.mark.parametrize("last", [LAST, ""], ids=["amid a module", "at the end of all"])
@pytest.mark.parametrize("bad_end", [False, True], ids=["ends well", "ends badly"])
def test_a_rig_that_stood_still_is_started_anew(tmp_path: Path, last: str, bad_end: bool) -> None:
    (tmp_path / "tests" / "system").mkdir(parents=True)
    for name in ("conftest.py", "alone.py"):
        shutil.copy(ROOT / "tests" / name, tmp_path / "tests")
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    text = SUITE.replace("BAD_END", str(bad_end)) + last
    (tmp_path / "tests" / "test_rig.py").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-s", "-p", "no:cacheprovider", "tests"]
    done = subprocess.run(
        command, cwd=tmp_path, env=dict(os.environ), capture_output=True, text=True, check=False, timeout=100
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{3 if last else 2} passed, {2 if bad_end else 1} rerun" in done.stdout
    assert not last or done.stdout.count("browser started") == 1, "the session's is kept"
    assert done.stdout.index("rig 1 ended") < done.stdout.index("rig 2 ended"), "each once, in order"
