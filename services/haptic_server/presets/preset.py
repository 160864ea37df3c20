"""One preset as bytes: a line with a checksum over everything after it, then JSON. Any thread.

Every byte counts: a file that was cut off, flipped in one bit or written over does not pass, and none of it is used.
"""

import hashlib
import json
import math
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, cast

_FORMAT = "drumstick-preset 1 sha256="
MAX_BYTES = 1_000_000
_MAX_CHARACTERS = 400  # of a name or a time
_MAX_SHOWN = 200  # characters of what is wrong
_NAME = re.compile(r"[A-Za-z0-9_-]([A-Za-z0-9 _.-]{0,58}[A-Za-z0-9_-])?")


class PresetError(ValueError):
    """Fault of a preset, its name or its file, with what to do."""


@dataclass(frozen=True)
class Preset:
    """Values by wire name, SI units; `scene` and the time are for people, `before` for the last good set.

    `before` holds the scene's own values at the time: a scene that was changed since is played as it is written.
    """

    name: str
    scene: str
    saved_at: str  # ISO 8601, UTC
    values: Mapping[str, float]
    before: Mapping[str, float]


def is_name(name: str) -> bool:
    """True when it can be the name of a file on every system."""
    return _NAME.fullmatch(name) is not None


def checked_name(name: str) -> str:
    """The name, when it can be that of a file on every system; PresetError says what is allowed."""
    if not is_name(name):
        raise PresetError(
            f"preset name {name[:80]!r}: use 1 to 60 letters, digits, spaces, _ . or -, no space or dot at either end"
        )
    return name


def to_bytes(preset: Preset) -> bytes:
    """The whole file."""
    body = json.dumps(asdict(preset), indent=1, allow_nan=False).encode()
    return f"{_FORMAT}{hashlib.sha256(body).hexdigest()}\n".encode() + body


def from_bytes(data: bytes) -> Preset:
    """The preset of a whole file; PresetError when a byte is missing, changed or too many."""
    head, newline, body = data[:MAX_BYTES].partition(b"\n")
    if not head.startswith(_FORMAT.encode()) or not newline:
        raise PresetError("not a preset of this version, or its beginning is damaged")
    if head != f"{_FORMAT}{hashlib.sha256(body).hexdigest()}".encode() or len(data) > MAX_BYTES:
        raise PresetError("damaged or changed by hand: its checksum does not fit")
    try:
        tables = _table(json.loads(body, object_pairs_hook=_once_each))
        return Preset(
            name=_text(tables["name"]),
            scene=_text(tables["scene"]),
            saved_at=_text(tables["saved_at"]),
            values=_numbers(tables["values"]),
            before=_numbers(tables["before"]),
        )
    except (ValueError, KeyError, TypeError, RecursionError, OverflowError) as error:
        words = repr(error)[:_MAX_SHOWN]
        raise PresetError(f"its checksum fits, but it is no preset: {words}") from None


def _once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        raise ValueError("a name stands twice in one table")
    return table


def _table(given: object) -> dict[str, Any]:
    if not isinstance(given, dict):
        raise TypeError(f"a table was expected, not a {type(given).__name__}")
    return cast(dict[str, Any], given)


def _text(given: object) -> str:
    if not isinstance(given, str) or len(given) > _MAX_CHARACTERS:
        raise TypeError(f"a text of at most {_MAX_CHARACTERS} characters was expected")
    given.encode()  # UnicodeEncodeError, a ValueError: half a character could not be sent to anybody
    return given


def _numbers(given: object) -> dict[str, float]:
    return {_text(name): _number(name, value) for name, value in _table(given).items()}


def _number(name: str, given: object) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise TypeError(f"{name} is no number")
    value = float(given)  # OverflowError: a whole number may have thousands of digits
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}")
    return value
