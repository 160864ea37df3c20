"""Results of `drumstick accuracy`: the file that a run leaves, and the one of this version."""

import json
import os
from pathlib import Path
from typing import Any

from drumstick_lab.checkout import RESULTS
from realtime.regular_file import read_text
from rig.accuracy_files import FILE
from rig.exit_status import unavailable

UNFINISHED = "accuracy-unfinished.json"  # of a run that was stopped or failed
_MAX_BYTES = 20_000_000
FULL = RESULTS / FILE
# What the panel draws: rows of the mesh that a scene can have, and of the stick.
_MACHINE = ("processor", "date", "quick")
_MESH = ("renderer", "rim", "precision", "measured", "ns_per_sample", "rms_cents")
_STICK = ("ns_per_s", "error_contacts")


def keep(found: dict[str, Any], out: Path, name: str = FILE) -> None:
    """Write the result into the folder, whole or not at all. Raises CommandError."""
    beside = out / f".{name}.{os.getpid()}"
    try:
        beside.write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        beside.replace(out / name)
    except OSError as error:
        unavailable(f"{out}: cannot be written: {error.strerror}")


def is_full(out: Path) -> bool:
    """True when a full run's result lies there."""
    try:
        return json.loads(read_text(out / FILE, _MAX_BYTES))["machine"]["quick"] is False
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def shipped() -> dict[str, Any]:
    """A full run on a named machine, measured by whoever made this version; docs/accuracy-and-time.md shows it."""
    return json.loads(FULL.read_text(encoding="utf-8"))


def summary(found: dict[str, Any]) -> str:
    """Text of the file that the instrument carries: what its panel draws of a result."""
    kept = {
        "machine": {name: found["machine"][name] for name in _MACHINE},
        "mesh": {"rows": [{n: row[n] for n in _MESH} for row in found["mesh"]["rows"] if _is_played(row)]},
        "stick": {"rows": [{n: row[n] for n in _STICK} for row in found["stick"]["rows"]]},
    }
    return json.dumps(kept, indent=1, allow_nan=False) + "\n"


def _is_played(row: dict[str, Any]) -> bool:
    played = {"renderer": "mesh", "rim": "weights", "precision": "float32", "measured": True}
    return all(row[name] == value for name, value in played.items())
