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
_MOST_BYTES = 1_000_000
_NAME = re.compile(r"[A-Za-z0-9_-]([A-Za-z0-9 _.-]{0,58}[A-Za-z0-9_-])?")


class PresetError(ValueError):
    """What is wrong with a preset, its name or its file, and what to do."""


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
    """Whether it can be that of a file on every system."""
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
    head, newline, body = data[:_MOST_BYTES].partition(b"\n")
    if not head.startswith(_FORMAT.encode()) or not newline:
        raise PresetError("not a preset of this version, or its beginning is damaged")
    if head != f"{_FORMAT}{hashlib.sha256(body).hexdigest()}".encode() or len(data) > _MOST_BYTES:
        raise PresetError("damaged or changed by hand: its checksum does not fit")
    try:
        tables = cast(dict[str, Any], json.loads(body))
        return Preset(
            name=str(tables["name"]),
            scene=str(tables["scene"]),
            saved_at=str(tables["saved_at"]),
            values=_numbers(tables["values"]),
            before=_numbers(tables["before"]),
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise PresetError(f"its checksum fits, but it is no preset: {error!r}") from None


def _numbers(given: object) -> dict[str, float]:
    numbers = {str(name): float(value) for name, value in cast(dict[str, Any], given).items()}
    for name, value in numbers.items():
        if not math.isfinite(value):
            raise ValueError(f"{name} is {value}")
    return numbers
