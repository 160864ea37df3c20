"""Check, before anything is computed, that figures can be drawn and written here. Raises CommandError."""

import sys
import tempfile
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from rig.exit_status import unavailable, usage_error


def _requirement() -> str:
    # "matplotlib<4,>=3.10; extra == 'figures'", as the installed project declares it
    for line in metadata.requires("haptic-drumstick") or []:
        requirement, _, condition = line.partition(";")
        if "figures" in condition:
            return requirement.strip()
    return "matplotlib"


def missing_matplotlib() -> str:
    """The one line to type where matplotlib is missing; empty where it is there."""
    return "" if find_spec("matplotlib") else f"{sys.executable} -m pip install '{_requirement()}'"


def require_matplotlib() -> None:
    """Stop with the one line to type where matplotlib is missing."""
    if line := missing_matplotlib():
        unavailable(f"figures need matplotlib; type: {line}")


def require_folder(out: Path) -> None:
    """Make the folder, and see that files can be written to it."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except (FileExistsError, NotADirectoryError):
        usage_error(f"--out {out}: a file is in the way; give a folder")
    except OSError as error:
        unavailable(f"--out {out}: cannot be written: {error.strerror}")
