"""Every struck drum of the shipped scenes is measured by bands and octaves, beside a recording or alone."""

from drumstick_lab.benchmarks.recordings.beside_recordings import KINDS, OCTAVES_HZ, STROKES, kept
from drumstick_lab.measuring.stored import read
from drumstick_lab.pages import sounds_page


def test_drums_that_a_mallet_strikes_are_measured_by_bands_and_octaves() -> None:
    measured = read("beside_recordings")["scenes"]
    assert set(measured) == set(KINDS)
    for name, drum in measured.items():
        assert (len(drum["bands_dB"]), len(drum["t60_s"])) == (STROKES, len(OCTAVES_HZ)), name


def test_the_page_shows_each_and_says_where_no_recording_is() -> None:
    sections = dict(part.split("\n", 1) for part in sounds_page.page().split("\n## ")[1:])
    for name in sorted(set(KINDS) & set(sections)):
        assert "| T60, s |" in sections[name], name
        assert ("no recording to compare with" in sections[name]) == (KINDS[name][0] == ""), name
        assert ("recorded, dB" in sections[name]) == (KINDS[name][1] != ""), name


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
