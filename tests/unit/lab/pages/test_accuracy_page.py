"""The first screen of docs/accuracy-and-time.md: each set-up by its measured numbers, and what nobody should choose."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from drumstick_lab.accuracy import store
from drumstick_lab.accuracy.choices import named, never
from drumstick_lab.benchmarks import accuracy
from drumstick_lab.measuring import stored
from drumstick_lab.pages.measured import accuracy_page


def test_the_first_table_has_what_a_rig_that_played_took(monkeypatch: pytest.MonkeyPatch) -> None:
    latency = stored.read("strike_latency")
    latency["rows"]["at_once"]["sound_ms"] = {"p1": 7.0, "p50": 7.7, "p99": 8.0}
    read = stored.read

    def slower(name: str) -> dict[str, Any]:
        return latency if name == "strike_latency" else read(name)

    monkeypatch.setattr(accuracy_page.stored, "read", slower)
    first = accuracy_page.page().partition("If one thing")[0]
    lines = [line for line in first.splitlines() if line.startswith("| ")][1:]
    assert len(lines) == 8
    assert sum("| 7.7 ms ± 0.50 |" in line for line in lines) == 6
    for row, _ in never(store.shipped()["whole"]["rows"]):
        assert named(row) in first


def test_the_whole_way_tells_each_row_once_and_the_wire() -> None:
    text = accuracy_page.page().partition("## The whole way")[2]
    for row in store.shipped()["whole"]["rows"]:
        assert text.count(f"| {row['playing']} | {row['choice']}") >= 1
    assert "| a strike to another program | OSC |" in text


def test_the_quick_run_is_timed_with_nothing_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    says = "import os, sys; sys.exit(os.listdir(os.environ['XDG_CACHE_HOME']) != [] or not os.path.isdir(sys.argv[1]))"
    monkeypatch.setattr(accuracy, "_QUICK", (sys.executable, "-c", says))
    monkeypatch.setenv("XDG_CACHE_HOME", str(Path(__file__).parent))
    assert accuracy.quick_first_s() > 0.0
    monkeypatch.setattr(accuracy, "_QUICK", (sys.executable, "-c", "import sys; sys.exit(1)"))
    with pytest.raises(subprocess.CalledProcessError):
        accuracy.quick_first_s()
