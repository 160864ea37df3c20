"""Files that somebody named: regular files only, and never more read of one than a limit. Waits for the disk only.

A device of that name could be read for ever, and a pipe would hold up whoever opens it. What cannot be read is an
OSError whose strerror says why, as the system's own are.
"""

import errno
import io
import os
import stat
from pathlib import Path
from typing import BinaryIO, TextIO

_NEVER_WAIT = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)  # Windows has neither
_NOT_INHERITED = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOINHERIT", 0)


def opened(path: Path, most_bytes: int) -> BinaryIO:
    """The file, open for reading; whoever reads it all at once uses `read_bytes`. Raises OSError."""
    file = open(path, "rb", opener=_open_at_once)  # noqa: SIM115  the caller closes it
    try:
        found = os.fstat(file.fileno())
        if not stat.S_ISREG(found.st_mode):
            raise _not_regular(path)
        if found.st_size > most_bytes:
            raise _too_large(path, most_bytes)
    except OSError:
        file.close()
        raise
    return file


def read_bytes(path: Path, most_bytes: int) -> bytes:
    """All of the file. Raises OSError, also when it has more than `most_bytes`."""
    with opened(path, most_bytes) as file:
        content = file.read(most_bytes + 1) or b""  # None: one of /proc that would make us wait
    if len(content) > most_bytes:  # it grew, or told no size, as those of /proc do
        raise _too_large(path, most_bytes)
    return content


def created(path: Path) -> int:
    """A descriptor to write the file with, new or emptied; whoever calls closes it. Raises OSError."""
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | _NEVER_WAIT | _NOT_INHERITED, 0o644)
    except OSError as error:
        if error.errno == errno.ENXIO:  # a pipe that nobody reads, a device that is not there
            raise _not_regular(path) from error
        raise
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise _not_regular(path)
        os.ftruncate(descriptor, 0)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def read_text(path: Path, most_bytes: int) -> str:
    """All of a UTF-8 file, its line ends as newlines. Raises OSError, UnicodeDecodeError."""
    return read_bytes(path, most_bytes).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")


def read_lines(path: Path, most_bytes: int) -> TextIO:
    """Like `read_text`, as lines with their own ends, for csv; raises OSError, and UnicodeDecodeError when they are
    read.
    """
    return io.TextIOWrapper(io.BytesIO(read_bytes(path, most_bytes)), encoding="utf-8", newline="")


def write_text(path: Path, text: str) -> None:
    """Write all of a UTF-8 file. Raises OSError."""
    with open(created(path), "w", encoding="utf-8") as file:
        file.write(text)


def write_bytes(path: Path, content: bytes) -> None:
    """Write all of a file. Raises OSError."""
    with open(created(path), "wb") as file:
        file.write(content)


def _open_at_once(name: str, flags: int) -> int:
    return os.open(name, flags | _NEVER_WAIT)


def _not_regular(path: Path) -> OSError:
    return OSError(errno.EINVAL, "not a regular file, but a device, a pipe or the like", str(path))


def _too_large(path: Path, most_bytes: int) -> OSError:
    return OSError(errno.EFBIG, f"more than {most_bytes} bytes", str(path))
