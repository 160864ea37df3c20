"""A slice of the coverage-guided fuzzing: eight seconds on each reader, from the stored corpus on."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("atheris", reason="atheris has wheels for Linux on x86_64 and Python up to 3.13 alone")

FUZZ = "drumstick_lab.benchmarks.robustness.fuzz"
TARGETS = ("osc", "payloads", "keys", "scenes", "rig files", "presets", "recordings", "page", "page messages")
SLICE_S = 8


def _fuzzed(target: str, seconds: int, found: Path) -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-m",
        FUZZ,
        "--check",
        "--target",
        target,
        "--seconds",
        str(seconds),
        "--found",
        found,
    ]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=200)


@pytest.mark.long
@pytest.mark.parametrize("target", TARGETS)
def test_no_input_breaks_a_reader(target: str, tmp_path: Path) -> None:
    done = _fuzzed(target, SLICE_S, tmp_path / "found")
    assert done.returncode == 0, done.stdout + done.stderr
    assert not list((tmp_path / "found").iterdir())
    name, _, told = done.stdout.strip().rpartition("\n")[2].partition(": ")
    assert name == target
    assert int(told.split()[0]) > 0  # inputs were read


@pytest.mark.long
def test_a_fault_that_only_branches_lead_to_is_found(tmp_path: Path) -> None:
    done = _fuzzed("planted", 60, tmp_path / "found")
    assert done.returncode == 1, done.stdout + done.stderr
    (found,) = (tmp_path / "found").iterdir()
    assert found.read_bytes().startswith(b"drum")
