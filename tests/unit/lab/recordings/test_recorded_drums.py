"""Every struck drum of the shipped scenes is measured by bands and octaves, beside a recording or alone."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.render import render
from drumstick_lab.benchmarks.recordings import fit_to_recording
from drumstick_lab.benchmarks.recordings.beside_recordings import (
    OCTAVES_HZ,
    RATE_HZ,
    SECONDS,
    STROKES,
    Measures,
    apart_by_band,
    kept,
    measured,
    real_from_held_out,
    speeds_of,
)
from drumstick_lab.measuring.made_beside import BESIDE_ALL, KINDS, PLACE, place_of, scene_of
from drumstick_lab.measuring.stored import read
from drumstick_lab.pages import sounds_page
from drumstick_lab.pages.measured import measured_drums


def test_drums_that_a_mallet_strikes_are_measured_by_bands_and_octaves() -> None:
    drums = read("beside_recordings")["scenes"]
    assert set(drums) == set(KINDS)
    for name, drum in drums.items():
        assert (len(drum["bands_dB"]), len(drum["t60_s"])) == (STROKES, len(OCTAVES_HZ)), name
        assert drum["place"] == place_of(name), name


def test_drums_of_a_set_are_struck_alike_and_others_where_their_scenes_play_them() -> None:
    assert {place_of(name) for name in ("tom", "snare, strainer off", "bass-drum")} == {PLACE}
    assert [place_of(name) for name in ("timpani", "conga", "frame-drum")] == [0.75, 0.65, 0.5]


def test_the_page_shows_each_and_says_where_no_recording_is() -> None:
    drums = read("beside_recordings")["scenes"]
    sections = dict(part.split("\n", 1) for part in sounds_page.page().split("\n## ")[1:])
    for name in sorted(set(KINDS) & set(sections)):
        section, drum = sections[name], drums[name]
        assert ("no recording to compare with" in section) == (KINDS[name][0] == ""), name
        assert ("recorded, dB" in section) == (KINDS[name][1] != ""), name
        assert ("(images/beside-" in section) == (KINDS[name][1] != "" or name in BESIDE_ALL), name
        for stroke, levels in enumerate(drum["bands_dB"], 1):
            assert f"| {stroke} | {' '.join(f'{level:.0f}' for level in levels)} |" in section, name
        (rise,) = [line for line in section.splitlines() if line.startswith("| rise")]
        assert f" dB | {drum['rise_dB']:.1f} |" in rise, name
        (decays,) = [line for line in section.splitlines() if line.startswith("| T60, s |")]
        t60_s = ["-" if value is None else f"{value:.2f}" for value in drum["t60_s"]]
        assert decays.split(" | ")[1].removesuffix(" |") == " ".join(t60_s), name


TOMS = ("high-tom", "mid-tom", "low-tom")


def test_toms_are_as_near_to_kits_that_nothing_was_fitted_to_as_real_toms_are() -> None:
    """The goal of 7 dB is for the toms together, over all pairs (5.8). A single one may have 7.5, because `high-tom`
    misses 7 by 0.4 (decision 0065); each is nearer than most real toms of another kit."""
    found = read("beside_recordings")
    real = found["real_from_held_out_dB"]["tom"]
    toms = [found["scenes"][name] for name in TOMS]
    assert np.median([apart for tom in toms for apart in tom["distance_dB"]["held_out"].values()]) <= 7.0
    for tom in toms:
        assert tom["median_held_out_dB"] <= 7.5
        assert tom["median_held_out_dB"] < np.median(list(real.values()))
        assert 7.0 <= tom["rise_dB"] <= 15.0
    assert found["scenes"]["snare"]["median_held_out_dB"] <= 4.0


def test_a_conga_is_as_near_to_hand_drums_that_it_was_not_fitted_to_as_they_are_to_one_another() -> None:
    found = read("beside_recordings")
    conga, real = found["scenes"]["conga"], found["real_from_held_out_dB"]["hand drum"]
    assert set(conga["distance_dB"]["held_out"]) == {"Bongo high", "Bongo low"}
    assert conga["median_held_out_dB"] <= 7.0
    assert conga["median_held_out_dB"] < np.median(list(real.values()))
    assert 5.0 <= conga["rise_dB"] <= 15.0


def _of_one_level(*bands_dB: float) -> Measures:
    return Measures(
        np.repeat(np.array(bands_dB)[:, None], 5, axis=1),
        np.zeros((len(bands_dB), 27)),
        np.zeros(len(bands_dB)),
        np.ones(8),
    )


def test_a_drum_of_the_only_kit_that_is_held_out_has_no_others_to_be_judged_by() -> None:
    found = {
        "work": {"Djembe 1": _of_one_level(-20.0)},
        "held_out": {"Bongo high": _of_one_level(-23.0), "Bongo low": _of_one_level(-25.0)},
    }
    assert real_from_held_out("hand drum", found) == {"Djembe 1": 4.0}


def test_beside_a_single_stroke_a_drum_is_as_bright_as_its_own_on_average() -> None:
    ours, real = _of_one_level(-30.0, -20.0, -10.0), _of_one_level(-20.0)
    assert fit_to_recording._parts(ours, real) == (0.0, 0.0, 0.0)
    assert fit_to_recording._parts(ours, _of_one_level(-20.0, -20.0)) != (0.0, 0.0, 0.0)


def test_the_snares_wires_make_noise_of_its_upper_octaves() -> None:
    """Median of five dynamics: 10 dB and more from 2 to 8 kHz over the strainer off, and as flat as a real one's."""
    found = read("beside_recordings")
    edges, scenes = found["edges_Hz"], found["scenes"]
    rise = np.median(
        np.subtract(scenes["snare"]["bands_dB"], scenes["snare, strainer off"]["bands_dB"]), axis=0
    )
    assert rise[edges.index(2000.0) : edges.index(8000.0)].min() >= 10.0
    assert scenes["snare"]["flatness"] >= 0.12


@pytest.mark.parametrize("name", [name for name, (kind, _) in KINDS.items() if kind])
def test_each_drum_beside_recordings_is_what_was_measured(name: str) -> None:
    """Levels of a middle stroke, between 0.5 and 16 kHz: a scene that is changed has to be measured again."""
    scene = scene_of(name)
    blow = strike_for_speed(scene, speeds_of(scene)[2], place_of(name), 0.0)
    sound = render(scene, [blow], SECONDS, RATE_HZ).astype(np.float64)
    levels = measured([(sound, float(RATE_HZ))]).bands[0]
    stored = read("beside_recordings")["scenes"][name]["bands_dB"][2]
    np.testing.assert_allclose(levels, stored, atol=0.5)


def test_one_stroke_says_how_bright_and_several_how_that_grows() -> None:
    """Mean of a recording of several strokes and one of a single stroke, which a fit seeks."""
    several, single = (
        Measures(np.array(levels, float), np.zeros((len(levels), 27)), np.zeros(len(levels)), np.ones(8))
        for levels in ([[-20, -30, -40, -50, -60], [-18, -25, -31, -42, -55]], [[-18, -18, -18, -14, -25]])
    )
    mean = fit_to_recording._mean([several, single])
    np.testing.assert_allclose(np.diff(mean.bands, axis=0), np.diff(several.bands, axis=0))
    np.testing.assert_allclose(mean.bands.mean(axis=0), [-18.5, -22.75, -26.75, -30.0, -41.25])


def test_what_a_distance_is_made_of() -> None:
    """A drum that is darker by 5 dB in all bands is the same drum but for its level."""
    real = np.array([[-20.0, -25.0, -30.0, -35.0, -50.0]] * STROKES)
    made_of = apart_by_band(real - 5.0, [real, real, real + 1.0])
    assert made_of == {"held_out_bands_dB": [-5.0] * 5, "median_held_out_but_for_level_dB": 0.0}


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


def test_each_kind_is_judged_by_its_own_scenes(monkeypatch: pytest.MonkeyPatch) -> None:
    """`tom` among the toms, though made beside none. The page says where pickups are compared with microphones."""
    page = "\n".join(_shown(read("beside_recordings"), monkeypatch))
    judged = {part.partition("s of different kits")[0]: part for part in page.split("How much real ")[1:]}
    tables = {kind: re.findall(r"^\| ([\w-]+) \| [+-]", part, re.MULTILINE) for kind, part in judged.items()}
    assert tables == {
        "bass drum": ["bass-drum"],
        "hand drum": ["conga"],
        "snare": ["snare"],
        "tom": ["high-tom", "low-tom", "mid-tom", "tom"],
    }
    assert re.findall(r"^`([\w-]+)` is heard by pickups", page, re.MULTILINE) == ["snare", "tom"]


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


def test_a_sound_is_rendered_anew_for_another_scene_or_other_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sounds_page, "source_hash", lambda _: "code")
    now = {"digest": sounds_page.digest("tom"), "sources": "code"}
    assert sounds_page.kept({"tom": now}) == {"tom": now}
    for other in (
        {**now, "sources": "before"},
        {"digest": now["digest"]},
        {**now, "digest": "another scene"},
    ):
        assert sounds_page.kept({"tom": other}) == {}
    assert sounds_page.kept({"no more": now}) == {}


def test_the_page_says_by_which_code_each_sound_was_rendered(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    stored = json.loads(sounds_page.STORED.read_text(encoding="utf-8"))
    rows = {name: {**row, "version": "abc"} for name, row in stored.items()}
    rows["tom"]["version"] = "def-dirty"
    monkeypatch.setattr(sounds_page, "STORED", tmp_path / "sounds.json")
    sounds_page.STORED.write_text(json.dumps(rows), encoding="utf-8")
    assert "Rendered by version abc of the code; but `tom` def-dirty." in sounds_page.page()
