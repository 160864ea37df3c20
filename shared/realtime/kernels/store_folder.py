"""Folder of the compiled kernels. Imports no numba, for programs that compile nothing. Any thread."""

import os
from pathlib import Path

KERNEL_SUFFIX = ".nbc"  # numba's: one file a compiled kernel


def store_folder() -> Path:
    """The folder of the store, which need not exist: one folder in it for each module and state of its sources."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(base) / "haptic-drumstick" / "kernels"
