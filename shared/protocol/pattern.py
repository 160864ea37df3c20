"""Names of rigs with `*` in them, and the liveliness tokens by which services are seen. Any thread."""

import re
from typing import NamedTuple

from protocol.keys import checked_rig

_PATTERN = re.compile(r"[A-Za-z0-9_*-][A-Za-z0-9_.*-]{0,39}")
_PREFIX, _ALIVE = "drumstick", "alive"


class Presence(NamedTuple):
    """Meaning of a token: a service of a rig is there."""

    rig: str
    service: str
    instance: str


def is_pattern(text: str) -> bool:
    """True when it stands for any number of rigs, rather than being the name of one."""
    return "*" in text


def checked_pattern(text: str) -> str:
    """A rig's name, or one in which * stands for any letters, digits, _ . and -, or for none; else ValueError."""
    if not is_pattern(text):
        return checked_rig(text)
    if not _PATTERN.fullmatch(text):
        raise ValueError(
            f"pattern {text!r}: use 1 to 40 letters, digits, _ . - or *, not a dot first, e.g. stage-*"
        )
    return text


def alive_key(pattern: str = "*", service: str = "*") -> str:
    """The tokens of a service in all rigs that `pattern` stands for, in Zenoh's own form."""
    chunk = re.sub(r"\*+", "$*", pattern)
    return f"{_PREFIX}/{'*' if chunk == '$*' else chunk}/{_ALIVE}/{service}/*"


def presence_of(key: str) -> Presence | None:
    """Presence of the token at `key`; None for one that is not of this wire."""
    parts = key.split("/")
    if len(parts) != 5 or (parts[0], parts[2]) != (_PREFIX, _ALIVE):
        return None
    try:
        return Presence(checked_rig(parts[1]), parts[3], parts[4])
    except ValueError:
        return None
