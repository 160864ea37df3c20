"""The command `drumstick audio-test`: what it offers, and where its process does not end."""

import subprocess
from typing import Any

import pytest
from typer.testing import CliRunner

from rig.cli.command import app
from rig.exit_status import LACKING, CommandError
from rig.machine import audio_test


def test_a_device_that_stands_still_ends_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[float] = []

    def hangs(command: list[str], timeout: float, **_: Any) -> None:
        given.append(timeout)
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(audio_test, "_strikes_per_s", lambda *_: 24.0)
    monkeypatch.setattr(subprocess, "run", hangs)
    for seconds in (3.0, 30.0):
        with pytest.raises(CommandError, match="stands still") as raised:
            audio_test.audio_test("roll", "auto", 48_000, (), seconds, as_json=False)
        assert raised.value.status == LACKING
    assert given[1] - given[0] >= 2 * 6 * 27.0


def test_its_help_offers_no_file_since_it_refuses_one() -> None:
    assert "wav" not in CliRunner().invoke(app, ["audio-test", "--help"]).output.lower()
    with pytest.raises(CommandError, match="a file is never late"):
        audio_test.audio_test("roll", "wav:roll.wav", 48_000, (), 3.0, as_json=False)
