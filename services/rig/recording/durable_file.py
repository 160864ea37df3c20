"""A new file whose content is on the disk when `sync` returns. The writing thread only; every call may block."""

import os
from pathlib import Path


class DurableFile:
    """Made by the constructor, which raises FileExistsError or another OSError; nothing that exists is touched.

    Written straight to the system, so that a process that is killed has lost nothing of what it wrote.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.size = 0
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self._unsynced = True
        folder = os.open(path.parent, os.O_RDONLY | os.O_CLOEXEC)
        try:
            os.fsync(folder)  # the name too must outlive a power cut
        finally:
            os.close(folder)

    def write(self, content: bytes) -> int:
        """Append all of it. OSError when the disk is full, with as much written as there was room for."""
        rest = memoryview(content)
        while rest:
            written = os.write(self._fd, rest)
            self.size += written
            self._unsynced = True
            rest = rest[written:]
        return len(content)

    def tell(self) -> int:
        """Number of bytes written."""
        return self.size

    def flush(self) -> None:
        """Do nothing: no bytes are held back."""

    def sync(self) -> None:
        """Return when the disk has it all; at once when nothing is new."""
        if self._unsynced:
            os.fsync(self._fd)
            self._unsynced = False

    def close(self) -> None:
        """Close it; write errors show earlier, in `sync`. Idempotent."""
        descriptor, self._fd = self._fd, -1
        if descriptor >= 0:
            os.close(descriptor)
