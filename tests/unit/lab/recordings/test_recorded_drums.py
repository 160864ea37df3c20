"""Every struck drum of the shipped scenes is measured by bands and octaves, beside a recording or alone."""

from typing import Any

import pytest

from drumstick_lab.benchmarks.recordings.beside_recordings import KINDS, OCTAVES_HZ, STROKES, kept
from drumstick_lab.measuring.stored import read
from drumstick_lab.pages import sounds_page
from drumstick_lab.pages.measured import measured_drums


def test_drums_that_a_mallet_strikes_are_measured_by_bands_and_octaves() -> None:
    measured = read("beside_recordings")["scenes"]
    assert set(measured) == set(KINDS)
    for name, drum in measured.items():
        assert (len(drum["bands_dB"]), len(drum["t60_s"])) == (STROKES, len(OCTAVES_HZ)), name


def test_the_page_shows_each_and_says_where_no_recording_is() -> None:
    measured = read("beside_recordings")["scenes"]
    sections = dict(part.split("\n", 1) for part in sounds_page.page().split("\n## ")[1:])
    for name in sorted(set(KINDS) & set(sections)):
        section, drum = sections[name], measured[name]
        assert ("no recording to compare with" in section) == (KINDS[name][0] == ""), name
        assert ("recorded, dB" in section) == (KINDS[name][1] != ""), name
        for stroke, levels in enumerate(drum["bands_dB"], 1):
            assert f"| {stroke} | {' '.join(f'{level:.0f}' for level in levels)} |" in section, name
        (rise,) = [line for line in section.splitlines() if line.startswith("| rise")]
        assert f" dB | {drum['rise_dB']:.1f} |" in rise, name
        (decays,) = [line for line in section.splitlines() if line.startswith("| T60, s |")]
        t60_s = ["-" if value is None else f"{value:.2f}" for value in drum["t60_s"]]
        assert decays.split(" | ")[1].removesuffix(" |") == " ".join(t60_s), name


def _shown(found: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Lines of the page of everything that was measured, for this result."""
    monkeypatch.setattr(measured_drums, "read", lambda _: found)
    return measured_drums.recordings()


def test_the_table_has_no_distance_where_no_recording_is(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = {
        line.split("`")[1]: line for line in _shown(read("beside_recordings"), monkeypatch) if "| `" in line
    }
    assert set(rows) == set(KINDS)
    for name, row in rows.items():
        assert row.endswith("| no recording | - |") == (KINDS[name][0] == ""), name
        assert (f"({KINDS[name][1]})" in row) == (KINDS[name][1] != ""), name


def test_both_pages_say_which_rows_are_older_than_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {**read("beside_recordings"), "kept": {"snare": "2026-01-01, version abc"}}
    words = "Measured earlier than the others, and kept: `snare` 2026-01-01, version abc."
    assert words in _shown(found, monkeypatch)
    monkeypatch.setattr(sounds_page, "read", lambda _: found)
    assert words in sounds_page.page().splitlines()
    assert measured_drums.kept_rows({**found, "kept": {}}) == []


def test_a_scene_that_is_not_measured_anew_keeps_its_own_date() -> None:
    before = {
        "machine": {"date": "2026-02-02", "commit": "abc"},
        "scenes": {"tom": {}, "snare": {}, "conga": {}},
        "kept": {"snare": "2026-01-01, version not known"},
    }
    assert kept(before, ["conga"]) == {
        "tom": "2026-02-02, version abc",
        "snare": "2026-01-01, version not known",
    }
