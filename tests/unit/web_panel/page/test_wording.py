import math
from typing import Any

import msgspec
import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Meter, Readback
from rig_messages import state
from web_panel.page.wording import (
    figure,
    hint_of,
    limited_words,
    measured,
    microseconds,
    notice_of,
    output_words,
    range_of,
    readback_note,
    sound_words,
    spoken_unit,
    steady,
)

TABLE = table_of(parse(shipped_text("roll"), "roll.toml"))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (5000.0, "5000"), (0.2, "0.2"), (23.0512, "23.05"), (-0.02, "−0.02"), (0.002, "0.002"),
        (1e6, "1000000"), (123456.0, "123456"), (1.2345e-5, "1.2e-05"), (0.99999, "1"), (math.nan, "–"), (1e9, "1e+09"),
    ],
)  # fmt: skip
def test_figures(value: float, text: str) -> None:
    assert figure(value) == text


@pytest.mark.parametrize(
    ("unit", "spoken"),
    [
        ("m/s", "metres per second"),
        ("N/m", "newtons per metre"),
        ("N s/m", "newton seconds per metre"),
        ("kg/m^2", "kilograms per metre squared"),
        ("dB", "decibels"),
        ("s/m", "seconds per metre"),
        ("N/m^p", "newtons per m^p"),
        ("1", ""),
        ("", ""),
    ],
)
def test_units_are_read_aloud_in_words(unit: str, spoken: str) -> None:
    assert spoken_unit(unit) == spoken


def test_units_follow_numbers_unless_there_is_none() -> None:
    assert measured(5000.0, "N/m") == "5000 N/m"
    assert measured(0.5, "1") == "0.5"
    assert steady(-1.26, 1) == "−1.3"


@pytest.mark.parametrize(("value", "text"), [(289.4, "289 µs"), (4000.0, "4.0 ms"), (2.5e6, "2.5 s")])
def test_lateness_is_worded_in_its_own_size(value: float, text: str) -> None:
    assert microseconds(value) == text


@pytest.mark.parametrize("name", sorted(TABLE))
def test_every_hint_has_words_range_unit_and_equation(name: str) -> None:
    q, hint = TABLE[name].quantity, hint_of(TABLE[name])
    assert q.words in hint
    assert range_of(q) in hint
    assert q.unit in hint
    assert q.equation in hint


def test_the_glide_has_the_one_control_that_counts_in_the_scene() -> None:
    for text, name, limits in (
        ("glide_cents = 90", "tension.glide", "0 .. 1200 cents"),
        ("young_GPa = 5.2", "tension.young", "0.01 .. 50 GPa"),
    ):
        table = table_of(parse(f"[drum.effects.tension]\n{text}\n", "gliding.toml"))
        hints = {row: hint_of(table[row]) for row in table if row.startswith("tension.")}
        assert list(hints) == [name]
        assert f"Wire name {name}, {limits}" in hints[name]
        assert "Another drum is built for it" in hints[name]


def test_a_pickup_has_a_control_for_each_coordinate_where_the_scene_asks_for_it() -> None:
    table = table_of(parse('[listen]\npickup_places = "live"\n', "live.toml"))
    hints = {name: hint_of(row) for name, row in table.items() if name.startswith("pickup-")}
    assert list(hints) == ["pickup-1.x", "pickup-1.y", "pickup-2.x", "pickup-2.y"]
    assert (
        "Place of pickup 2 on the head: y. Wire name pickup-2.y, −1 .. 1 of the radius" in hints["pickup-2.y"]
    )
    assert "takes effect at once" in hints["pickup-2.y"]


@pytest.mark.parametrize(
    ("status", "headline", "advice", "mood"),
    [
        ("ready", "Ready", "Lift the stick", "good"),
        ("playing", "Playing", "Tune", "busy"),
        ("panic", "Panic: zero force", "drumstick arm", "bad"),
        ("fault: NaN from the device", "Fault: NaN from the device", "drumstick arm", "bad"),
        ("fault:", "Fault: no reason given", "drumstick arm", "bad"),
        ("resting", "Resting", "drumstick doctor", "wait"),
    ],
)
def test_each_state_says_what_to_do_next(status: str, headline: str, advice: str, mood: str) -> None:
    notice = notice_of(True, state(status=status), 0.0, "main")
    assert (notice.headline, notice.mood) == (headline, mood)
    assert advice in notice.advice


def test_a_server_never_heard_and_one_not_heard_any_more() -> None:
    assert notice_of(False, None, None, "main").headline == "Waiting for the haptic server"
    assert "No router" in notice_of(False, None, None, "main").advice
    assert "router answers" in notice_of(True, None, None, "main").advice
    silent = notice_of(True, state(status="playing"), 4.2, "main")
    assert silent.headline == "No data from the haptic server for 4 s"
    assert silent.mood == "bad"


def test_a_wanted_change_of_scene_is_no_alarm() -> None:
    changing = notice_of(True, state(status="playing"), 4.2, "main", due="tom")
    assert (changing.headline, changing.mood) == ("Changing to tom; no data for 4 s", "wait")
    assert "PANIC" in changing.advice
    for still_there in ("playing", "panic", "fault: late"):
        assert notice_of(True, state(status=still_there), 0.0, "main", due="tom") == notice_of(
            True, state(status=still_there), 0.0, "main"
        )


@pytest.mark.parametrize(
    ("status", "words"), [("panic", "arm"), ("fault: late", "arm"), ("resting", "doctor"), ("", "up")]
)
def test_what_to_type_names_the_rig_unless_it_is_the_default_one(status: str, words: str) -> None:
    told = state(status=status) if status else None
    silence = 0.0 if status else None
    assert f"“drumstick {words} --rig left”" in notice_of(True, told, silence, "left").advice
    assert f"“drumstick {words}”" in notice_of(True, told, silence, "main").advice


def test_a_readback_says_what_it_waits_for() -> None:
    assert readback_note(None) == "no data yet"
    assert (
        readback_note(Readback(value=1.0, revision=1, pending=True))
        == "waits until the stick is above the head"
    )
    assert readback_note(Readback(value=1.0, revision=1)) == ""


def _metered(**values: Any) -> Meter:
    meter = Meter(
        id="a", t_ns=0, sink="null", peak_left=0.0, peak_right=0.0, load=0.21, xruns=7, latency_ms=5.3,
        played=40, late=1, duplicates=0,
    )  # fmt: skip
    return msgspec.structs.replace(meter, **values)


def test_the_sound_servers_in_a_line() -> None:
    assert sound_words([]) == "no sound server heard"
    meter = _metered()
    assert sound_words([meter]) == "null: 40 played, 1 late, 7 xruns, load 21 %, latency 5.3 ms"


def test_level_and_peak_are_in_dB_of_full_scale() -> None:  # noqa: N802
    loud = _metered(output_rms=0.125, output_peak=0.999)
    assert output_words([loud]) == "level −18 dB, peak 0 dB"
    silent = _metered(sink="hall", output_rms=1e-5)  # its peak: of a server that has no such meter
    assert output_words([loud, silent]) == "null: level −18 dB, peak 0 dB; hall: level –, peak –"
    assert output_words([_metered(output_peak=math.inf, output_rms=math.nan)]) == "level –, peak –"
    assert output_words([]) == ""


def test_a_limited_output_is_to_be_turned_down() -> None:
    assert limited_words([], limited_lately=False) == ""
    assert limited_words([_metered()], limited_lately=False) == "limited: no"
    bent = _metered(limited_frames=120)
    assert limited_words([bent], True) == "limited: turn the output down (120 frames since its start)"
    assert limited_words([bent], False) == "limited: not now (120 frames since its start)"
    clipped = _metered(limited_frames=5, clipped_frames=3)
    assert limited_words([bent, clipped], True).endswith("(125 frames since its start, 3 of them clipped)")
