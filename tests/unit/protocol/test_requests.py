"""Payloads of a set query: msgpack from programs, JSON from people, a ValueError for everything else."""

import json
import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.requests import (
    ANYBODY,
    Claim,
    RollRequest,
    StrikeRequest,
    requested_roll,
    requested_strike,
    requested_text,
    requested_value,
    requested_values,
    requested_way,
)

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(FINITE | st.integers(-(2**53), 2**53))
def test_one_value_in_both_forms(value: float) -> None:
    assert requested_value(msgspec.msgpack.encode([1, value])) == (value, ANYBODY)
    assert requested_value(json.dumps(value).encode()) == (value, ANYBODY)
    assert requested_value(f" \n{json.dumps(value)}\t".encode()) == (value, ANYBODY)


@given(st.dictionaries(st.text(min_size=1), FINITE, min_size=1, max_size=8))
def test_several_values_in_both_forms(values: dict[str, float]) -> None:
    assert requested_values(msgspec.msgpack.encode([1, values])) == (values, ANYBODY)
    assert requested_values(json.dumps(values).encode()) == (values, ANYBODY)


@given(FINITE, FINITE, FINITE)
def test_a_strike_in_both_forms(x: float, y: float, level: float) -> None:
    wanted = StrikeRequest(x, y, level)
    assert requested_strike(msgspec.msgpack.encode([1, [x, y, level]])) == wanted
    assert requested_strike(json.dumps([x, y, level]).encode()) == wanted
    named = msgspec.msgpack.encode([1, [x, y, level, "page"], {"lease": "a"}])
    assert requested_strike(named) == StrikeRequest(x, y, level, "page")


@pytest.mark.parametrize(
    "payload",
    [b"", b"3", b"[]", b"[1, 2]", b'[0, 0, "loud"]', b'[0, 0, 1, "a\\nb"]', b"[0, 0, 1, 2]", b"[0, 0, 1, null, 3]",
     b"[0, 0, true]", msgspec.msgpack.encode([0.1, 0.2, 0.3]), msgspec.msgpack.encode([1, [0, 0, 1, "x" * 41]])],
)  # fmt: skip
def test_what_is_no_strike(payload: bytes) -> None:
    with pytest.raises(ValueError, match=r"\w+"):
        requested_strike(payload)


def test_nan_passes_here_and_is_left_to_the_parameter() -> None:
    assert math.isnan(requested_value(msgspec.msgpack.encode([1, math.nan]))[0])


@pytest.mark.parametrize(
    "payload",
    [b"", b"true", b"null", b'"3"', b"[3]", b"{}", b"1e999x", b"\x92\x02\x03", b"\x93\x01\x02\x03", b"\xc3", b"3 4",
     msgspec.msgpack.encode([1, True]), msgspec.msgpack.encode([1, "3"]), msgspec.msgpack.encode([1, None]),
     b"1" * 400],
)  # fmt: skip
def test_what_is_not_one_number(payload: bytes) -> None:
    with pytest.raises(ValueError, match=r"\w+"):
        requested_value(payload)


@pytest.mark.parametrize(
    "payload",
    [b"", b"3", b"{}", b'{"m": true}', b'{"m": "3"}', b'{"m": null}', b"[[]]", msgspec.msgpack.encode([1, {}]),
     msgspec.msgpack.encode([1, [["m", 3.0]]]), msgspec.msgpack.encode([2, {"m": 3.0}])],
)  # fmt: skip
def test_what_is_not_a_map_of_numbers(payload: bytes) -> None:
    with pytest.raises(ValueError, match=r"\w+"):
        requested_values(payload)


@given(st.binary(max_size=100))
def test_arbitrary_bytes_are_a_value_error(payload: bytes) -> None:
    for read in (requested_value, requested_values, requested_strike, requested_way, requested_roll):
        try:
            read(payload)
        except ValueError as error:
            assert str(error)


@pytest.mark.parametrize("opening", [b"\x91", b"\x81\xa1a", b"[", b'{"a":'])
def test_nesting_without_end_is_a_value_error(opening: bytes) -> None:
    for read in (requested_value, requested_values):
        with pytest.raises(ValueError, match="neither msgpack nor JSON"):
            read(opening * 100_000)


def test_a_claim_comes_third() -> None:
    claimed = msgspec.msgpack.encode([1, 0.5, {"lease": "mine", "revision": 7}])
    assert requested_value(claimed) == (0.5, Claim("mine", 7))
    assert requested_text(msgspec.msgpack.encode([1, "slow", {"revision": 0}])) == ("slow", Claim("", 0))
    assert requested_text(b'"slow"') == ("slow", ANYBODY)


@pytest.mark.parametrize(
    "claim", [3, "mine", {"lease": 3}, {"revision": 1.5}, {"revision": True}, {"leese": "mine"}, {1: 2}, None]
)
def test_a_claim_that_is_none_is_refused(claim: object) -> None:
    with pytest.raises(ValueError, match="claim"):
        requested_value(msgspec.msgpack.encode([1, 0.5, claim]))


@pytest.mark.parametrize("payload", [b"", b"3", b"[1]", msgspec.msgpack.encode([1, 5]), b'{"a": 1}'])
def test_a_name_is_a_text(payload: bytes) -> None:
    with pytest.raises(ValueError, match=r"expected|empty"):
        requested_text(payload)


@given(FINITE, FINITE)
def test_a_way_is_a_value_and_perhaps_seconds(value: float, seconds: float) -> None:
    assert requested_way(json.dumps([value, seconds]).encode()) == (value, seconds, ANYBODY)
    assert requested_way(json.dumps(value).encode()) == (value, 0.0, ANYBODY)
    claimed = msgspec.msgpack.encode([1, [value, seconds], {"lease": "mine"}])
    assert requested_way(claimed) == (value, seconds, Claim("mine"))


@pytest.mark.parametrize("payload", [b"[]", b"[1, 2, 3]", b'["a"]', b"[[1]]", b"[1, null]", b"{}"])
def test_what_is_no_way(payload: bytes) -> None:
    with pytest.raises(ValueError, match=r"\w+"):
        requested_way(payload)


def test_a_roll_is_a_map_of_rate_and_level() -> None:
    assert requested_roll(b'{"rate": 20, "seconds": 4}') == (RollRequest(20.0, None, 4.0), ANYBODY)
    whole = msgspec.msgpack.encode([1, {"rate": 20, "level": 0.5}, {"lease": "mine"}])
    assert requested_roll(whole) == (RollRequest(20.0, 0.5), Claim("mine"))
    for wrong in (b"{}", b'{"seconds": 3}', b'{"rate": 20, "tempo": 3}', b"20", b'{"rate": null}'):
        with pytest.raises(ValueError, match=r"expected|number"):
            requested_roll(wrong)
