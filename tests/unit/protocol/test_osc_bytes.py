"""OSC packets are the bytes that python-osc's builder makes of the same arguments."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_message_builder import OscMessageBuilder

from protocol import osc

_NUMBERS = st.floats(-osc.MAX_FLOAT, osc.MAX_FLOAT, width=32)
_WHOLE = st.integers(-(2**31), 2**31 - 1)
_TEXTS = st.text(st.characters(max_codepoint=126, exclude_characters="\0"), max_size=9)


def built(address: str, *arguments: osc.Argument) -> bytes:
    builder = OscMessageBuilder(address)
    for value in arguments:
        builder.add_arg(value, "i" if isinstance(value, int) else None)  # or the lowest has 64 bits
    return builder.build().dgram


@given(_WHOLE, _NUMBERS, _NUMBERS)
def test_numbers(seq: int, x: float, speed: float) -> None:
    strike = built("/drumstick/strike", seq, x, x, speed, 0.5, speed)
    assert osc.strike("/drumstick", seq, x, x, speed, 0.5, speed) == strike
    assert osc.release("/a.b", seq, speed, x, 1.0, x) == built("/a.b/release", seq, speed, x, 1.0, x)


@given(_TEXTS, _TEXTS, _WHOLE)
def test_texts_of_every_length(rig: str, state: str, strikes: int) -> None:
    assert osc.alive("/drumstick", rig, state, strikes) == built("/drumstick/alive", rig, state, strikes)
    assert osc.pong("/d", [rig, strikes]) == built("/d/pong", rig, strikes)


def test_what_no_listener_reads_is_not_sent() -> None:
    assert osc.error("/d", "/d/\u00fc", "a\0b") == built("/d/error", "/d/?", "a?b")
    assert osc.strike("/d", 2**31, 0.0, 0.0, 1.0, 0.5, 1.0) == built("/d/strike", 0, 0.0, 0.0, 1.0, 0.5, 1.0)
    for wrong in (float("nan"), float("inf"), 1e39):
        with pytest.raises(ValueError, match="finite"):
            osc.level("/d", wrong)


def test_what_is_not_of_its_type_is_refused_and_not_sent_as_another() -> None:
    text: Any = "0.5"
    number: Any = 1
    for encode in (
        lambda: osc.level("/d", text),
        lambda: osc.strike("/d", text, 0.0, 0.0, 1.0, 0.5, 1.0),
        lambda: osc.preset("/d", number),
    ):
        with pytest.raises(ValueError, match="no OSC argument of type"):
            encode()
