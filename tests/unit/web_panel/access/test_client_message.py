import contextvars
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from web_panel.access.client_message import (
    CAMERA_AT_FIRST,
    MAX_FRAME_BYTES,
    ClientMessages,
    is_click,
    is_number,
    is_short_text,
    sent_to,
)


def frame(message: object) -> bytes:
    return msgspec.msgpack.encode(message)


@pytest.fixture
def messages() -> ClientMessages:
    known = ClientMessages()
    known.controls["slider"] = is_number
    known.controls["button"] = is_click
    return known


def update(value: object, uuid: str = "slider", **more: object) -> bytes:
    return frame({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}, **more})


def test_a_sliders_number_and_a_buttons_click_pass(messages: ClientMessages) -> None:
    assert messages.admits(update(0.25))
    assert messages.admits(update(3))
    assert messages.admits(update(True, "button"))
    assert messages.refused == 0


def test_the_message_in_hand_tells_its_own_control_what_was_sent(messages: ClientMessages) -> None:
    def here() -> None:
        assert sent_to("slider", "nothing") == "nothing"
        for value in (0.25, 0.3, float("nan")):
            messages.admits(update(value))
        assert sent_to("slider", "nothing") == 0.3  # what is refused brought nothing
        assert sent_to("button", "nothing") == "nothing"

    contextvars.copy_context().run(here)
    assert sent_to("slider", "nothing") == "nothing"


@pytest.mark.parametrize(
    "value", [float("nan"), float("inf"), -float("inf"), True, None, "0.2", "nan", [1.0], {"a": 1}]
)
def test_what_is_no_finite_number_does_not_reach_a_slider(messages: ClientMessages, value: object) -> None:
    assert not messages.admits(update(value))
    assert messages.refused == 1


@pytest.mark.parametrize(
    "updates",
    [
        {"update_cb": []},
        {"value": 0.2, "update_cb": []},
        {"props": {}},
        {"sync_cb": None},
        {"removed": True},
        {"min": 0.0},
        {},
        [["value", 0.2]],
        None,
    ],
)
def test_no_attribute_but_the_value_can_be_written(messages: ClientMessages, updates: object) -> None:
    assert not messages.admits(frame({"type": "GuiUpdateMessage", "uuid": "slider", "updates": updates}))


def test_only_our_own_keys_pass(messages: ClientMessages) -> None:
    messages.keys.add("panic key")
    assert messages.admits(frame({"type": "CommandTriggerMessage", "uuid": "panic key"}))
    for wrong in (
        {"uuid": "another"},
        {"uuid": ["panic key"]},
        {"uuid": None},
        {},
        {"uuid": "panic key", "removed": True},
        {"uuid": "slider"},
    ):
        assert not messages.admits(frame({"type": "CommandTriggerMessage", **wrong}))


def test_unknown_controls_and_extra_fields_are_refused(messages: ClientMessages) -> None:
    assert not messages.admits(update(0.2, "unknown"))
    assert not messages.admits(update(0.2, excluded_self_client=3))
    assert not messages.admits(update(1, "button"))


@pytest.mark.parametrize(
    "message",
    [
        {"type": "ShareUrlRequest"},
        {"type": "ShareUrlDisconnect"},
        {"type": "RunJavascriptMessage", "source": "alert(1)"},
        {"type": "GuiButtonHoldMessage", "uuid": "button", "frequency": 10.0},
        {"type": "FileTransferStartUpload", "source_component_uuid": "slider"},
        {"type": "ResetGuiMessage"},
        {"type": ["GuiUpdateMessage"]},
        {},
        [],
        3,
    ],
)
def test_no_other_message_passes(messages: ClientMessages, message: object) -> None:
    assert not messages.admits(frame(message))


def test_text_frames_rubbish_and_long_frames_are_refused(messages: ClientMessages) -> None:
    assert not messages.admits("GuiUpdateMessage")
    assert not messages.admits(b"\xc1")
    assert not messages.admits(b"\x91" * 5000)
    assert not messages.admits(update(0.2) + b"\x00")


def test_a_frame_may_be_as_long_as_the_longest_and_no_longer(messages: ClientMessages) -> None:
    assert MAX_FRAME_BYTES == 16384
    messages.controls["text"] = lambda value: True
    around = len(update("x" * 10_000, "text")) - 10_000
    assert messages.admits(update("x" * (MAX_FRAME_BYTES - around), "text"))
    assert not messages.admits(update("x" * (MAX_FRAME_BYTES - around + 1), "text"))


def test_a_short_text_is_printable_and_no_longer_than_asked() -> None:
    assert is_short_text("", 0)
    assert is_short_text("häß 0", 5)
    for wrong in ("häß 01", "a\nb", "\x7f", b"abc", 5, None, ["a"]):
        assert is_short_text(wrong, 5) is False


def camera(**changes: object) -> bytes:
    known: dict[str, Any] = msgspec.msgpack.decode(CAMERA_AT_FIRST)
    return frame({**known, **changes})


def test_a_camera_passes_when_it_is_nothing_but_finite_numbers(messages: ClientMessages) -> None:
    assert messages.admits(CAMERA_AT_FIRST)
    assert not messages.admits(camera(position=[0.0, 0.0]))
    assert not messages.admits(camera(position=[0.0, 0.0, float("nan")]))
    assert not messages.admits(camera(fov="wide"))
    assert not messages.admits(camera(camera_cb=[]))


@pytest.mark.parametrize("name", ["wxyz", "position", "look_at", "up_direction"])
def test_each_vector_of_a_camera_has_its_own_length(messages: ClientMessages, name: str) -> None:
    length = 4 if name == "wxyz" else 3
    assert messages.admits(camera(**{name: [0.5] * length}))
    for wrong in ([0.5] * (length - 1), [0.5] * (length + 1), ["0.5"] * length, "0" * length, 0.5, None):
        assert not messages.admits(camera(**{name: wrong}))


@pytest.mark.parametrize("name", ["fov", "near", "far", "image_height", "image_width"])
def test_each_number_of_a_camera_is_one(messages: ClientMessages, name: str) -> None:
    assert messages.admits(camera(**{name: 2}))
    for wrong in (True, "2", [2], None, float("inf")):
        assert not messages.admits(camera(**{name: wrong}))
    known: dict[str, Any] = msgspec.msgpack.decode(CAMERA_AT_FIRST)
    assert not messages.admits(frame({key: value for key, value in known.items() if key != name}))


@given(st.binary(max_size=200))
def test_no_frame_raises(raw: bytes) -> None:
    ClientMessages().admits(raw)


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)


@given(_VALUES, _VALUES, _VALUES)
def test_no_message_raises(uuid: Any, updates: Any, more: Any) -> None:
    known = ClientMessages()
    known.controls["slider"] = is_number
    known.admits(frame({"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates}))
    known.admits(frame({"type": "GuiUpdateMessage", "uuid": "slider", "updates": {"value": more}}))
    known.admits(camera(position=updates, fov=more))
