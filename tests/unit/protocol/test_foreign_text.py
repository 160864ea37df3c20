"""Names that strangers chose: none steers no terminal, fills no line, and no log."""

import logging

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.foreign_text import shown
from protocol.rate_limited_log import RateLimitedLog


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("alive/record/light", "alive/record/light"),
        ("Trömmel 鼓", "Trömmel 鼓"),
        ("\x1b[2Jgone", r"\x1b[2Jgone"),
        ("one\nERROR: two\r", r"one\nERROR: two\r"),
        ("\u202eabc\x9b", r"\u202eabc\x9b"),
        (r"\x1b", r"\\x1b"),
        (7, "7"),
    ],
)
def test_what_steers_a_terminal_is_told_and_not_done(text: object, expected: str) -> None:
    assert shown(text) == expected


def test_a_long_name_is_cut() -> None:
    assert shown("x" * 121) == "x" * 117 + "..."
    assert shown("x" * 120) == "x" * 120
    assert shown("\n" * 5, 8) == r"\n\n..."


@given(st.text(), st.integers(8, 200))
def test_any_text_is_one_printable_line_of_bounded_length(text: str, most: int) -> None:
    line = shown(text, most)
    assert line.isprintable()
    assert len(line) <= most


def test_a_flood_of_distinct_keys_makes_few_lines_and_keeps_nothing(caplog: pytest.LogCaptureFixture) -> None:
    now = 0
    limited_log = RateLimitedLog(lambda: now, quiet_s=10.0)
    kept = len(vars(limited_log))
    with caplog.at_level(logging.WARNING):
        for number in range(6000):
            now = number * 10_000_000  # a hundred a second, for a minute
            limited_log.warn(f"drumstick/r/param/\x1b[2J\n{number}: not a number")
    assert len(caplog.messages) == 6
    assert caplog.messages[0] == r"drumstick/r/param/\x1b[2J\n0: not a number"
    assert caplog.messages[1].endswith("(and 999 more)")
    assert all(message.isprintable() for message in caplog.messages)
    assert len(vars(limited_log)) == kept
