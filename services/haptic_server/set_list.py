"""A set list in a rig's run folder: the scenes of an evening in their order, and which of them plays.

Whoever changes the scenes writes it; the gateway reads it to know what comes next. Control threads.
"""

from pathlib import Path

import msgspec

from haptic_server import files
from realtime.regular_file import read_text

_MAX_BYTES = 1_000_000
MAX_SCENES = 1000
NEXT, PREVIOUS = "next", "previous"  # what may be asked for instead of a name


class SetList(msgspec.Struct, frozen=True):
    """Scenes by shipped name or path, in their order; `at`: which one was played last, from 0."""

    scenes: tuple[str, ...]
    at: int = 0

    def text(self) -> str:
        """Text of its file."""
        return msgspec.json.encode(self).decode()


def read(run_dir: Path) -> SetList | None:
    """The set list of the rig, None where it has none."""
    try:
        return msgspec.json.decode(read_text(run_dir / files.SET_LIST, _MAX_BYTES), type=SetList)
    except (OSError, ValueError):
        return None
