"""The pre-scan: never raises, refuses what has stopped other parsers, and agrees with python-osc on the rest."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder

from haptic_server.gateway.osc.prescan import MAX_ADDRESS, MAX_BYTES, Message, Unreadable, prescan
from protocol import osc
from stability.catalogue import shows

_ADDRESSES = st.text("abcXYZ019_.-+!$%&'()/:;<=>@\\^`|~\"", min_size=0, max_size=60).map(lambda s: "/" + s)
_ARGUMENTS = st.lists(
    st.one_of(
        st.tuples(st.just("i"), st.integers(-(2**31), 2**31 - 1)),
        st.tuples(st.just("f"), st.floats(width=32, allow_nan=False)),
        st.tuples(st.just("d"), st.floats(allow_nan=False)),
        st.tuples(st.just("s"), st.text(st.characters(min_codepoint=1, max_codepoint=127), max_size=20)),
    ),
    max_size=12,
)


def _built(address: str, arguments: list[tuple[str, object]]) -> bytes:
    builder = OscMessageBuilder(address)
    for tag, value in arguments:
        builder.add_arg(value, tag)  # type: ignore[arg-type]
    return builder.build().dgram


def _padded(text: bytes) -> bytes:
    return text + bytes(4 - len(text) % 4)


@given(st.binary(max_size=2000))
def test_arbitrary_bytes_never_raise(datagram: bytes) -> None:
    assert isinstance(prescan(datagram), (Message, Unreadable))


@given(st.binary(max_size=64), st.binary(max_size=12))
def test_what_begins_like_a_message_never_raises(rest: bytes, tags: bytes) -> None:
    found = prescan(b"/drumstick/ping\0," + tags + b"\0" + rest)
    assert isinstance(found, (Message, Unreadable))


@given(_ADDRESSES, _ARGUMENTS)
def test_what_python_osc_builds_is_read_alike(address: str, arguments: list[tuple[str, object]]) -> None:
    datagram = _built(address, arguments)
    other = OscMessage(datagram)
    assert prescan(datagram) == Message(other.address, tuple(other.params))


@given(_ADDRESSES, _ARGUMENTS.filter(bool), st.data())
def test_a_truncated_message_is_refused(
    address: str, arguments: list[tuple[str, object]], data: st.DataObject
) -> None:
    datagram = _built(address, arguments)
    cut = data.draw(st.integers(0, len(datagram) - 1))
    found = prescan(datagram[:cut])
    # Cut right behind the address it is the old form of a message without arguments.
    assert isinstance(found, Unreadable) or (cut == len(_padded(address.encode())) and found.args == ())


@given(_ADDRESSES, _ARGUMENTS, st.binary(min_size=1, max_size=16))
def test_bytes_behind_the_end_are_refused(
    address: str, arguments: list[tuple[str, object]], tail: bytes
) -> None:
    datagram = _built(address, arguments) + tail
    assert isinstance(prescan(datagram), Unreadable)


_HOSTILE = {
    "bundle with a negative element size": (b"#bundle\0" + struct.pack(">Qi", 1, -4), "bundles"),
    "bundle with a future time tag": (
        b"#bundle\0" + struct.pack(">Qi", 2**63, 16) + _padded(b"/a") + _padded(b",") + bytes(8),
        "bundles",
    ),
    "bundle of bundles": (
        b"#bundle\0" + bytes(8) + struct.pack(">i", 16) + b"#bundle\0" + bytes(8),
        "bundles",
    ),
    "bundle cut short": (b"#bundle", "bundles"),
    "address of stars": (_padded(b"/" + b"*" * 200), "patterns"),
    "address of alternatives": (_padded(b"/{a,b}[0-9]?"), "patterns"),
    "address with a space": (_padded(b"/drumstick/ping "), "patterns"),
    "address beyond ASCII": (_padded("/drümstick".encode()), "ASCII"),
    "address with a control character": (_padded(b"/a\nforged log line"), "ASCII"),
    "address without a slash": (_padded(b"drumstick"), "starts with /"),
    "address without an end": (b"/aaa", "no NUL padding"),
    "address padded with something": (b"/a\0x", "no NUL padding"),
    "long address": (_padded(b"/" + b"a" * MAX_ADDRESS), "longer than 255"),
    "huge": (bytes(MAX_BYTES + 4), "longer than 1536 bytes"),
    "largest datagram of UDP": (_padded(b"/" + b"a" * 65502), "longer than 1536 bytes"),
    "empty": (b"", "0 bytes"),
    "one byte": (b"/", "1 bytes"),
    "no comma": (_padded(b"/a") + _padded(b"f") + bytes(4), "comma"),
    "type tags without an end": (_padded(b"/a") + b",fff", "comma"),
    "too many arguments": (_padded(b"/a") + _padded(b"," + b"i" * 65) + bytes(260), "more than 64"),
    "argument missing": (_padded(b"/a") + _padded(b",f"), "shorter"),
    "double cut in half": (_padded(b"/a") + _padded(b",d") + bytes(4), "shorter"),
    "text without an end": (_padded(b"/a") + _padded(b",s") + b"abcd", "text argument"),
    "text missing": (_padded(b"/a") + _padded(b",s"), "text argument"),
    "text beyond ASCII": (_padded(b"/a") + _padded(b",s") + _padded(b"\xff"), "not ASCII"),
    "blob of negative size": (_padded(b"/a") + _padded(b",b") + struct.pack(">i", -4), "type b"),
    "array that never ends": (_padded(b"/a") + _padded(b",[[[["), "type ["),
    "time tag": (_padded(b"/a") + _padded(b",t") + bytes(8), "type t"),
    "64-bit integer": (_padded(b"/a") + _padded(b",h") + bytes(8), "type h"),
    "unprintable type": (_padded(b"/a") + _padded(b",\x01"), "type 0x01"),
}


@shows("message that never ends", "ours")
@pytest.mark.parametrize("name", _HOSTILE)
def test_hostile_datagrams_are_refused_with_the_reason(name: str) -> None:
    datagram, why = _HOSTILE[name]
    found = prescan(datagram)
    assert isinstance(found, Unreadable)
    assert why in found.why
    assert (found.address + found.why).isprintable()


def test_an_old_sender_leaves_out_the_type_tags() -> None:
    assert prescan(_padded(b"/drumstick/sync")) == Message("/drumstick/sync", ())


def test_the_longest_that_is_read() -> None:
    text = "a" * (MAX_BYTES - 8 - 1)
    datagram = _built("/a", [("s", text)])
    assert len(datagram) == MAX_BYTES
    assert prescan(datagram) == Message("/a", (text,))


def test_what_the_rig_sends_can_be_read_by_the_rig() -> None:
    datagram = osc.strike("/drumstick", 7, 0.5, -0.25, 1.5, 0.75, 12.5)
    assert prescan(datagram) == Message("/drumstick/strike", (7, 0.5, -0.25, 1.5, 0.75, 12.5))
