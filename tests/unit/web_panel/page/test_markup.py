import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Readback, State
from rig_messages import state, strike
from web_panel.computing.computing_messages import PredictedRoll, Reach
from web_panel.page import markup
from web_panel.page.reach_picture import closed_levels, closed_rates, rate_share, reach_picture
from web_panel.page.style import CSS
from web_panel.page.wording import Mood, Notice, is_no_roll, prediction_words

TABLE = table_of(parse(shipped_text("roll"), "roll.toml"))
EVIL = "<script>alert(1)</script>"


def told(status: str) -> State:
    return state(status=status, roll_rate_Hz=192.0, v_e_m_per_s=0.63, strikes=7)


STROKE = strike(seq=7, z_speed_m_per_s=0.55, level=0.31, peak_estimate_N=5.0, impulse_N_s=0.01)


def test_numbers_of_a_stick_that_plays() -> None:
    shown = markup.tiles(told("playing"), STROKE, old=False)
    assert ">192.0<" in shown
    assert ">0.63<" in shown
    assert "Strike 7" in shown
    assert "dr-old" not in shown
    assert '"dr-tiles dr-old"' in markup.tiles(told("playing"), STROKE, old=True)


@pytest.mark.parametrize("status", ["ready", "panic", "fault: late"])
def test_a_stick_that_does_not_play_has_no_rate_and_no_speed_and_its_last_strike_is_dimmed(
    status: str,
) -> None:
    shown = markup.tiles(told(status), STROKE, old=False)
    assert "192.0" not in shown
    assert "0.63" not in shown
    assert '<div class="dr-tile dr-old" data-part="strike"><i>Last strike</i><b>0.55</b>' in shown


def test_no_roll_and_a_rate_never_stand_side_by_side() -> None:
    ends = {end: PredictedRoll(end=end) for end in ("captured", "left", "unsettled", "endless", "")}
    for end, predicted in ends.items():
        said = prediction_words(predicted, {}, TABLE).verdict.startswith("no roll:")
        assert is_no_roll(predicted) == said, end
    assert "192.0" not in markup.tiles(told("playing"), STROKE, old=False, no_roll=True)


def test_a_forecast_and_a_rate_are_dimmed_while_nothing_plays() -> None:
    forecast = prediction_words(
        PredictedRoll(end="cycle", rate_Hz=23.1, v_lc_m_per_s=0.63, multiplier=0.7, period=1), {}, TABLE
    )
    reach = Reach("", 23.0, 0.3, [0.1, 1.0], [2.0, 5.0], [50.0, 40.0])
    for make in (
        lambda old: markup.prediction(forecast, old),
        lambda old: markup.named("rate", "Rate", "", "23.1", "Hz", old=old),
        lambda old: reach_picture(reach, 23.1, 0.3, plays=not old),
    ):
        assert "dr-old" in make(True)
        assert "dr-old" not in make(False)
    assert "when it plays 23.1 Hz" in reach_picture(reach, 23.1, 0.3, plays=False)


def test_sliders_of_rate_and_level_are_barred_where_no_roll_is_within_reach() -> None:
    reach = Reach("", 20.0, 0.3, [0.02, 0.5], [2.0, 10.0], [100.0, 20.0])
    assert closed_rates(reach, 0.5) == pytest.approx((rate_share(10.0), 1.0 - rate_share(20.0)))
    assert closed_rates(reach, 0.02) == (0.0, 0.0)
    below, above = closed_levels(reach, 60.0)
    assert below == 0.0
    assert 1.0 - above == pytest.approx(0.26, abs=0.01)
    assert closed_levels(reach, 2.0)[0] == 0.0
    assert closed_levels(reach, 500.0) == (0.0, 0.0)
    assert "--below:12.5%;--above:30.0%" in markup.barred("rate", (0.125, 0.3))


def test_what_is_chosen_is_marked_as_text() -> None:
    assert markup.chosen('a"b<c>') == '<div data-chosen="a&quot;b&lt;c&gt;" hidden></div>'


def test_what_the_network_says_is_never_markup() -> None:
    for made in (
        markup.notice(Notice(EVIL, EVIL, "bad")),
        markup.line(EVIL, "panic"),
        markup.health(None, None, EVIL, EVIL, EVIL, alarm=True),
        markup.control(TABLE["k_coll"], None, EVIL, large=True),
    ):
        assert "<script" not in made
        assert "&lt;script" in made


def test_a_control_shows_the_readback_and_then_one_note() -> None:
    row = TABLE["k_coll"]
    plain = markup.control(row, Readback(value=5000.0, revision=1), "", large=True)
    assert ">5000<u>N/m</u>" in plain
    assert "K<sub>coll</sub>" in plain
    assert row.quantity.words in plain
    waiting = markup.control(row, Readback(value=5000.0, revision=1, pending=True), "", large=True)
    assert "waits until the stick is above the head" in waiting
    accepted = markup.control(
        row, Readback(value=5000.0, revision=1), "", large=True, setpoint=6000.0, waits=True
    )
    assert 'data-part="setpoint">→ 6000 N/m<' in accepted
    assert "waits until the stick is above the head" in accepted
    assert "setpoint" not in markup.control(
        row, Readback(value=5000.0, revision=1), "", large=True, setpoint=5000.0
    )
    refused = markup.control(
        row, Readback(value=5000.0, revision=1, pending=True), "Refused: too much", large=True
    )
    assert "Refused: too much" in refused
    assert "waits" not in refused


def test_a_line_takes_room_for_its_words_only_unless_it_is_kept() -> None:
    assert markup.line("", "absent") == ""
    kept = markup.line("", "lease", lines=2)
    assert "--lines:2" in kept
    assert "data-part" not in kept
    assert kept.split(">")[0] == markup.line("Locked by Ada", "lease", alarm=True, lines=2).split(">")[0]


def test_a_panic_that_nobody_confirmed_takes_the_place_of_the_advice() -> None:
    condition = Notice("Not heard", "Check the cable.", "bad")
    assert "Check the cable." in markup.notice(condition)
    told = markup.notice(condition, "PANIC was not confirmed <yet>")
    assert "Not heard" in told
    assert 'data-part="panic">PANIC was not confirmed &lt;yet&gt;<' in told
    assert "Check the cable." not in told


@pytest.mark.parametrize(
    ("mood", "panic", "told"), [("busy", "", True), ("bad", "", False), ("busy", "late", False)]
)
def test_who_has_the_lock_is_told_where_nothing_is_worse(mood: Mood, panic: str, told: bool) -> None:
    shown = markup.notice(Notice("Condition", "Advice.", mood), panic, "Locked by <Ada>")
    assert ('data-part="lease">Locked by &lt;Ada&gt;<' in shown) == told


def test_the_tab_has_the_rigs_name() -> None:
    assert '<style data-title="left: drumstick" ' in markup.style("left")


@pytest.mark.parametrize(
    "reach", [None, Reach(why=EVIL), Reach("", 23.0, 0.3, [0.1, 1.0], [2.0, 5.0], [50.0, 40.0])]
)
def test_the_picture_of_the_reach_has_one_size_and_one_line_of_words(reach: Reach | None) -> None:
    drawn = reach_picture(reach, 0.0, 0.0)
    assert drawn.count('viewBox="0 0 300 110"') == drawn.count("--lines:1") == 1
    assert "<script" not in drawn
    assert ("<polygon" in drawn) == (reach is not None and not reach.why)


def test_the_style_fetches_nothing() -> None:
    assert "url(" not in CSS
    assert "@import" not in CSS
    assert CSS.count("{") == CSS.count("}")
