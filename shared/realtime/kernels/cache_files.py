"""Small files beside a module's compiled kernels: kept until the module, what it imports, Python or numba changes.

Ordinary Python threads; several processes may write at once, and the last one's text stays, whole.
"""

import contextlib
import time

from realtime.kernels.store import folder_of
from realtime.regular_file import read_text


def read_beside(module: str, name: str, most_bytes: int) -> str:
    """The text of the file `name`, at most so long. Raises OSError where there is none, and as `read_text` does."""
    folder = folder_of(module)
    if folder is None:
        raise FileNotFoundError(name)
    return read_text(folder / name, most_bytes)


def write_beside(module: str, name: str, text: str) -> None:
    """Keep the text as the file `name`; where it cannot be kept, nothing happens and no part of it is left."""
    folder = folder_of(module)
    if folder is None:
        return
    beside = folder / f".{name}.{time.monotonic_ns():x}"
    try:
        beside.write_text(text, encoding="utf-8")
        beside.replace(folder / name)
    except OSError:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
