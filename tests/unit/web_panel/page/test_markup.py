from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Readback
from web_panel.page import markup
from web_panel.page.style import CSS
from web_panel.page.wording import Notice

TABLE = table_of(parse(shipped_text("roll"), "roll.toml"))
EVIL = "<script>alert(1)</script>"


def test_what_the_network_says_is_never_markup() -> None:
    for made in (
        markup.notice(Notice(EVIL, EVIL, "bad")),
        markup.line(EVIL, "panic"),
        markup.health(None, None, EVIL),
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


def test_an_empty_line_takes_no_room() -> None:
    assert markup.line("", "panic") == ""


def test_the_style_fetches_nothing() -> None:
    assert "url(" not in CSS
    assert "@import" not in CSS
    assert CSS.count("{") == CSS.count("}")
