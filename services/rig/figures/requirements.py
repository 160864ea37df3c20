"""Check, before anything is computed, that figures can be written here. Raises CommandError."""

import tempfile
from pathlib import Path

from rig.exit_status import unavailable, usage_error


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
