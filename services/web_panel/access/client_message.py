"""Browser messages that are let through: a new value for one of our own controls, one of our keys, and where its
camera is.

viser itself would let a client overwrite any attribute of any control (`update_cb: []` removes it for everyone), send
NaN, and ask for a public share address. So nothing passes that is not described here. Pure, but for the table of
controls, which the main thread writes and viser's thread reads.
"""

import math
from collections.abc import Callable
from contextvars import ContextVar
from typing import Any, cast

import msgspec

Check = Callable[[object], bool]

MAX_FRAME_BYTES = 16 * 1024
_CAMERA_VECTORS = {"wxyz": 4, "position": 3, "look_at": 3, "up_direction": 3}
_CAMERA_NUMBERS = ("fov", "near", "far", "image_height", "image_width")

# viser runs callbacks only for clients whose camera it knows, and a browser tells its camera some time after the page
# is there: a PANIC pressed before that would do nothing. So each connection begins with this camera.
CAMERA_AT_FIRST = msgspec.msgpack.encode(
    {
        "type": "ViewerCameraMessage",
        "wxyz": [1.0, 0.0, 0.0, 0.0],
        "position": [3.0, 3.0, 3.0],
        "look_at": [0.0, 0.0, 0.0],
        "up_direction": [0.0, 0.0, 1.0],
        "fov": 1.0,
        "near": 0.01,
        "far": 1000.0,
        "image_height": 1,
        "image_width": 1,
    }
)


def is_number(value: object) -> bool:
    """A finite int or float, no bool, that fits a float."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def is_short_text(value: object, longest: int) -> bool:
    """A printable text of at most so many characters."""
    return isinstance(value, str) and len(value) <= longest and value.isprintable()


def is_click(value: object) -> bool:
    """True for what a button sends."""
    return value is True


# The control and the value of the message that is being handled. viser gives each message a task of its own, which
# begins with the context of the connection's reader: so a callback finds its own message here, whatever came after it,
# by this browser or another, and wherever the main thread has moved the control meanwhile.
_SENT: ContextVar[tuple[str, Any]] = ContextVar("sent")


def sent_to(uuid: str, otherwise: Any) -> Any:
    """The value that the present message brought for this control; `otherwise` where it brought none."""
    control, value = _SENT.get(("", None))
    return value if control == uuid else otherwise


class ClientMessages:
    """Decides about each frame; `controls` maps a control's id to the check of its value, `keys` are the ids of the
    keyboard's commands."""

    def __init__(self) -> None:
        self.controls: dict[str, Check] = {}
        self.keys: set[str] = set()
        self.refused = 0

    def admits(self, frame: object) -> bool:
        """True when viser may see this frame. viser's thread."""
        if self._admits(frame):
            return True
        self.refused += 1
        return False

    def _admits(self, frame: object) -> bool:
        if not isinstance(frame, bytes) or len(frame) > MAX_FRAME_BYTES:
            return False
        try:
            given = msgspec.msgpack.decode(frame)
        except (msgspec.MsgspecError, ValueError, RecursionError):
            return False
        if not isinstance(given, dict):
            return False
        message = cast(dict[object, object], given)
        kind = message.get("type")
        if kind == "CommandTriggerMessage":
            uuid = message.get("uuid")
            return set(message) == {"type", "uuid"} and isinstance(uuid, str) and uuid in self.keys
        if kind == "GuiUpdateMessage":
            return self._value_of_a_control(message)
        return kind == "ViewerCameraMessage" and _is_camera(message)

    def _value_of_a_control(self, message: dict[object, object]) -> bool:
        uuid, updates = message.get("uuid"), message.get("updates")
        if set(message) != {"type", "uuid", "updates"} or not isinstance(uuid, str):
            return False
        check = self.controls.get(uuid)
        if check is None or not isinstance(updates, dict):
            return False
        named = cast(dict[object, object], updates)
        if set(named) != {"value"} or not check(named["value"]):
            return False
        _SENT.set((uuid, named["value"]))
        return True


def _is_camera(message: dict[object, object]) -> bool:
    if set(message) != {"type", *_CAMERA_VECTORS, *_CAMERA_NUMBERS}:
        return False
    if not all(is_number(message[key]) for key in _CAMERA_NUMBERS):
        return False
    return all(_is_vector(message[key], length) for key, length in _CAMERA_VECTORS.items())


def _is_vector(value: object, length: int) -> bool:
    if not isinstance(value, list):
        return False
    items = cast(list[object], value)
    return len(items) == length and all(is_number(item) for item in items)
