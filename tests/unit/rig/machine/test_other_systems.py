"""The command where Python lacks what only Linux has: what computes works, what plays says why not."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import another_system
from rig.exit_status import LACKING


def ran(system: str, cwd: Path, *commands: str) -> list[tuple[int, str]]:
    words = json.dumps([command.split() for command in commands])
    command = [sys.executable, another_system.__file__, system, words]
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_on_windows_what_computes_works_and_a_rig_is_refused_in_words(tmp_path: Path) -> None:
    render = "render bare-drum --duration 0.2 --roll --out hit.wav"
    *worked, doctor, up = ran(
        "win32", tmp_path, "simulate roll --duration 1", "analyse roll", render, "doctor", "up"
    )
    assert [status for status, _ in worked] == [0, 0, 0], worked
    assert (tmp_path / "hit.wav").stat().st_size > 1000
    for status, words in (doctor, up):
        assert status == LACKING, words
        assert "here in WSL 2" in words
    assert "cannot play yet" in doctor[1]


@pytest.mark.long
def test_on_macos_doctor_says_what_was_not_tried(tmp_path: Path) -> None:
    ((status, words),) = ran("darwin", tmp_path, "doctor")
    assert status == 0, words
    assert "no real-time priority here" in words
    assert "ready to play" in words
