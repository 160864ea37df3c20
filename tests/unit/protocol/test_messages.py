"""Zenoh payloads: what is encoded comes back; anything else is a ValueError, never another exception."""

import math

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import messages
from protocol.messages import VERSION, Message, decode, encode
from stability.catalogue import shows

KINDS = [
    kind
    for kind in vars(messages).values()
    if isinstance(kind, type) and issubclass(kind, Message) and kind is not Message
]
FINITE = st.floats(allow_nan=False, allow_infinity=False)
SCALARS = {
    int: st.integers(-(2**63), 2**63 - 1),
    float: FINITE,
    str: st.text(max_size=40),
    bool: st.booleans(),
    bytes: st.binary(max_size=40),
    int | None: st.none() | st.integers(-(2**63), 2**63 - 1),
    float | None: st.none() | FINITE,
    dict[str, float]: st.dictionaries(st.text(max_size=10), FINITE, max_size=5),
}


def _any(kind: type[Message]) -> st.SearchStrategy[Message]:
    fields = {f.name: SCALARS[f.type] for f in msgspec.structs.fields(kind) if f.name != "version"}
    return st.builds(kind, **fields)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@given(st.data())
def test_a_message_comes_back(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(_any(kind))
    payload = encode(message)
    assert msgspec.msgpack.decode(payload)[0] == VERSION
    assert decode(payload, kind) == message


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@given(payload=st.binary(max_size=200))
def test_arbitrary_bytes_are_a_value_error(kind: type[Message], payload: bytes) -> None:
    try:
        message = decode(payload, kind)
    except ValueError as error:
        assert kind.__name__ in str(error)
    else:
        assert decode(encode(message), kind) == message


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@given(st.data())
def test_a_damaged_message_is_a_value_error(kind: type[Message], data: st.DataObject) -> None:
    """One byte changed or the end missing: another message, or a ValueError, and never a number that is not finite."""
    payload = bytearray(encode(data.draw(_any(kind))))
    at = data.draw(st.integers(0, len(payload) - 1))
    payload[at] = data.draw(st.integers(0, 255))
    cut = bytes(payload[: data.draw(st.integers(0, len(payload)))])
    for damaged in (bytes(payload), cut):
        try:
            message = decode(damaged, kind)
        except ValueError:
            continue
        for value in msgspec.structs.asdict(message).values():
            for number in value.values() if isinstance(value, dict) else [value]:
                assert not isinstance(number, float) or math.isfinite(number)


@shows("NaN in a message", "ours")
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_refused(kind: type[Message], number: float) -> None:
    sample = {int: 1, float: 0.5, str: "x", bool: True, dict[str, float]: {"m": 0.5}}
    sample |= {bytes: b"", int | None: None, float | None: 0.5}
    fields = {f.name: f.type for f in msgspec.structs.fields(kind) if f.name != "version"}
    for name, of in fields.items():
        if of not in (float, float | None, dict[str, float]):
            continue
        values = {key: sample[what] for key, what in fields.items()}
        values[name] = {"m": number} if of == dict[str, float] else number
        with pytest.raises(ValueError, match=name):
            decode(encode(kind(**values)), kind)


def test_another_version_is_refused() -> None:
    payload = msgspec.msgpack.encode([VERSION + 1, 7, 8])
    with pytest.raises(ValueError, match=f"Clock of version {VERSION + 1}, this is version {VERSION}"):
        decode(payload, messages.Clock)


def test_the_strike_is_laid_out_as_the_wire_says() -> None:
    strike = messages.Strike(
        boot=7, seq=3, t_ns=5, x=0.5, y=-0.5, z_speed_m_per_s=1.5, level=0.75, peak_estimate_N=12.0,
        contact_estimate_s=0.005, impulse_N_s=0.04,
    )  # fmt: skip
    laid_out = [1, 7, 3, 5, 0.5, -0.5, 1.5, 0.75, 12.0, 0.005, 0.04, "stick"]
    assert msgspec.msgpack.decode(encode(strike)) == laid_out
    older = decode(msgspec.msgpack.encode(laid_out[:10]), messages.Strike)
    assert (older.contact_estimate_s, older.impulse_N_s, older.source) == (0.005, 0.0, "stick")


def test_a_contact_is_laid_out_as_the_wire_says_and_may_end_after_its_forces() -> None:
    contact = messages.Contact(
        boot=7, seq=3, first_tick=40, rate_Hz=1000.0, forces=b"\0\0\x80?", t_ns=5, x=0.5, y=-0.5
    )
    assert msgspec.msgpack.decode(encode(contact)) == [1, 7, 3, 40, 1000.0, b"\0\0\x80?", 5, 0.5, -0.5]
    short = decode(msgspec.msgpack.encode([1, 7, 3, 40, 1000, b"\0\0\x80?"]), messages.Contact)
    assert (short.forces, short.t_ns, short.x, short.y) == (b"\0\0\x80?", None, None, None)


def test_a_meter_of_before_is_still_read() -> None:
    old = [1, "id", 5, "null", 0.1, 0.1, 0.2, 0, 3.0, 7, 0, 0]
    meter = decode(msgspec.msgpack.encode(old), messages.Meter)
    assert (meter.played, meter.underflows, meter.refused) == (7, 0, 0)
    assert (meter.output_peak, meter.output_rms, meter.limited_frames, meter.clipped_frames) == (
        0.0,
        0.0,
        0,
        0,
    )


def test_a_reader_of_before_reads_a_meter_of_now() -> None:
    """Fields are added at the end only, and a reader passes over those that it does not know."""
    meter = messages.Meter(
        id="id", t_ns=5, sink="null", peak_left=0.1, peak_right=0.2, load=0.3, xruns=4, latency_ms=3.0, played=7,
        late=8, duplicates=9, waiting="pitch", output_peak=0.5, output_rms=0.25, limited_frames=120, clipped_frames=3,
    )  # fmt: skip
    assert decode(encode(meter), messages.Meter) == meter
    laid_out = msgspec.msgpack.decode(encode(meter))
    assert laid_out[:12] == [1, "id", 5, "null", 0.1, 0.2, 0.3, 4, 3.0, 7, 8, 9]
    assert laid_out[18:] == ["pitch", 0.5, 0.25, 120, 3]
    fields = [(name, messages.Meter.__annotations__[name]) for name in messages.Meter.__struct_fields__[1:19]]
    older = msgspec.defstruct("Meter", fields, bases=(messages.Message,), array_like=True, kw_only=True)
    read = decode(encode(meter), older)
    assert all(getattr(read, name) == getattr(meter, name) for name, _ in fields)


@shows("message that never ends", "ours")
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@settings(max_examples=5)
@given(st.data())
def test_nesting_without_end_behind_the_last_field_is_a_value_error(
    kind: type[Message], data: st.DataObject
) -> None:
    payload = encode(data.draw(_any(kind)))
    head = 1 if payload[0] & 0xF0 == 0x90 else 3  # of an array: of up to 15 elements, or of more
    count = len(kind.__struct_fields__) + 1
    with pytest.raises(ValueError, match=f"not a {kind.__name__}"):
        decode(b"\xdc" + count.to_bytes(2, "big") + payload[head:] + b"\x91" * 1_000_000 + b"\xc0", kind)
