"""Version of the guard by its text: a stored result of the guard says with which it was made."""

import hashlib
import inspect
from collections.abc import Mapping
from typing import Any

from haptic_server.servo.force import guard


def guard_version() -> str:
    """The first 16 digits of the SHA-256 of the guard's source."""
    return hashlib.sha256(inspect.getsource(guard).encode()).hexdigest()[:16]


def is_of_this_guard(result: Mapping[str, Any]) -> bool:
    """True when the result was made with the guard of this checkout; one that names none was not."""
    return result.get("guard") == guard_version()
