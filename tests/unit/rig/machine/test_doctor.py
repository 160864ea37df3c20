"""Rows of `drumstick doctor` about packages and sound."""

import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from rig.machine import doctor
from rig.machine.real_time import examine

ROOT = Path(__file__).resolve().parents[4]


def test_every_package_that_is_needed_is_imported_by_something() -> None:
    files = [file for folder in ("services", "shared") for file in (ROOT / folder).rglob("*.py")]
    imported = {
        name
        for file in files
        for name in re.findall(r"^\s*(?:from|import) (\w+)", file.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert set(doctor._NEEDED) <= imported


def test_who_reads_of_sound_and_priority_learns_how_to_measure_them(monkeypatch: pytest.MonkeyPatch) -> None:
    devices = [{"name": "card", "max_output_channels": 2}, {"name": "microphone", "max_output_channels": 0}]
    monkeypatch.setitem(sys.modules, "sounddevice", SimpleNamespace(query_devices=lambda: devices))
    heard = doctor._audio()
    assert heard.good
    assert heard.found.startswith("card; ")
    assert "drumstick audio-test" in heard.found
    monkeypatch.setitem(sys.modules, "sounddevice", SimpleNamespace(query_devices=list))
    assert (doctor._audio().good, doctor._audio().found) == (False, "none")
    priority = next(seen for seen in examine() if seen.name == "real-time priority")
    assert "drumstick audio-test" in priority.remedy
