"""The bytes that the rig sends, read by python-osc: addresses and types as the table says, and nothing but i, f, s."""

import math
import struct
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_message import OscMessage

from protocol import osc

P = "/kit/left"
_MADE = {
    osc.STRIKE: osc.strike(P, 3, 0.5, -0.5, 1.25, 0.625, 10.0),
    osc.RELEASE: osc.release(P, 3, 1.0, 0.03, 12.0, 0.0055),
    osc.LEVEL: osc.level(P, 0.5),
    osc.X: osc.x(P, 0.5),
    osc.Y: osc.y(P, -0.5),
    osc.GATE: osc.gate(P, True),
    osc.PARAM: osc.param(P, "NAME", 5000.0),
    osc.PARAM_NORM: osc.param_norm(P, "NAME", 0.25),
    osc.ALIVE: osc.alive(P, "main", "ready", 12),
    osc.ERROR: osc.error(P, "/kit/left/nonsense", "no such address"),
    osc.PONG: osc.pong(P, []),
    osc.PRESET: osc.preset(P, "slow"),
    osc.LEASE: osc.lease(P, "Ada", 5.0),
    osc.ROLL_RATE: osc.roll(P, osc.ROLL_RATE, 23.05),
    osc.ROLL_LEVEL: osc.roll(P, osc.ROLL_LEVEL, 0.28),
}


def _tags(datagram: bytes) -> str:
    start = datagram.index(b",")
    return datagram[start + 1 : datagram.index(b"\0", start)].decode()


def test_every_row_has_an_encoder() -> None:
    assert set(_MADE) == set(osc.SENT)


@pytest.mark.parametrize("row", osc.SENT, ids=lambda row: row.path)
def test_address_and_types_are_those_of_the_table(row: osc.Sent) -> None:
    assert OscMessage(_MADE[row]).address == P + row.path
    assert _tags(_MADE[row]) == row.types
    assert set(row.types) <= set("ifs")


def test_values_arrive() -> None:
    assert OscMessage(_MADE[osc.STRIKE]).params == [3, 0.5, -0.5, 1.25, 0.625, 10.0]
    assert OscMessage(_MADE[osc.ALIVE]).params == ["main", "ready", 12]
    assert OscMessage(_MADE[osc.GATE]).params == [1]


@pytest.mark.parametrize("seq", [2**31 - 1, 2**31, 2**40 + 5])
def test_a_counter_beyond_31_bits_starts_again(seq: int) -> None:
    datagram = osc.strike(P, seq, 0.0, 0.0, 1.0, 0.5, 1.0)
    assert _tags(datagram) == "ifffff"
    assert OscMessage(datagram).params[0] == seq % 2**31


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e39])
@pytest.mark.parametrize(
    "encoder",
    [
        lambda v: osc.level(P, v),
        lambda v: osc.param(P, "k_coll", v),
        lambda v: osc.param_norm(P, "k_coll", v),
        lambda v: osc.pong(P, [v]),
        lambda v: osc.strike(P, 1, 0.0, 0.0, v, 0.5, 1.0),
    ],
)
def test_what_is_no_finite_32_bit_number_is_not_encoded(
    encoder: Callable[[float], bytes], value: float
) -> None:
    with pytest.raises(ValueError, match="finite 32-bit number"):
        encoder(value)


@pytest.mark.parametrize(("norm", "sent"), [(-0.5, 0.0), (0.25, 0.25), (5.4, 1.0)])
def test_norm_is_clipped(norm: float, sent: float) -> None:
    assert OscMessage(osc.param_norm(P, "z_h0", norm)).params == [sent]


def test_texts_become_short_ascii() -> None:
    datagram = osc.error(P, "/x", "Δv\0" + "a" * 5000)
    assert OscMessage(datagram).params[1] == "?v?" + "a" * 397
    assert len(datagram) < 1000


@given(
    st.lists(
        st.one_of(
            st.integers(-(2**31), 2**31 - 1),
            st.floats(width=32, allow_nan=False, allow_infinity=False),
            st.text(st.characters(min_codepoint=1, max_codepoint=127), max_size=500),
        ),
        max_size=8,
    )
)
def test_a_pong_brings_back_what_the_ping_had(args: list[osc.Argument]) -> None:
    assert OscMessage(osc.pong(P, args)).params == args


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_double_comes_back_as_a_float_or_not_at_all(value: float) -> None:
    if abs(value) > osc.MAX_FLOAT:
        with pytest.raises(ValueError, match="32-bit"):
            osc.pong(P, [value])
    else:
        assert OscMessage(osc.pong(P, [value])).params == list(struct.unpack(">f", struct.pack(">f", value)))


@pytest.mark.parametrize("prefix", ["/drumstick", "/kit/left", "/a/b/c/d", "/Rig_1.x-y"])
def test_prefixes_that_can_be_used(prefix: str) -> None:
    assert osc.checked_prefix(prefix) == prefix


@pytest.mark.parametrize(
    "prefix", ["", "/", "drumstick", "/a/", "/a b", "/a*", "/a/b/c/d/e", "/" + "a" * 33, "/ä"]
)
def test_prefixes_that_cannot(prefix: str) -> None:
    with pytest.raises(ValueError, match="OSC prefix"):
        osc.checked_prefix(prefix)
