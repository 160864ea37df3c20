"""Results of `drumstick accuracy`: the file that a run leaves, and the one that comes with the package."""

import json
import os
from pathlib import Path
from typing import Any

from realtime.regular_file import read_text
from rig.fault import lacking

FILE = "accuracy.json"
UNFINISHED = "accuracy-unfinished.json"  # of a run that was stopped or failed
_LARGEST_BYTES = 20_000_000
SHIPPED = Path(__file__).parent / "shipped.json"


def keep(found: dict[str, Any], out: Path, name: str = FILE) -> None:
    """Write the result into the folder, whole or not at all. Raises Stop."""
    beside = out / f".{name}.{os.getpid()}"
    try:
        beside.write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        beside.replace(out / name)
    except OSError as error:
        lacking(f"{out}: cannot be written: {error.strerror}")


def is_full(out: Path) -> bool:
    """Does a full run's result lie there?"""
    try:
        return json.loads(read_text(out / FILE, _LARGEST_BYTES))["machine"]["quick"] is False
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def shipped() -> dict[str, Any]:
    """A full run on a named machine, measured by whoever made this version; docs/accuracy-and-time.md shows it."""
    return json.loads(SHIPPED.read_text(encoding="utf-8"))
