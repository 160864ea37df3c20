"""Streams that take nothing: pipes filled to the brim."""

import contextlib
import os
from collections.abc import Iterator


def fill(fd: int) -> None:
    """Write until the pipe takes no more byte; whether writing blocks is as before."""
    was_blocking = os.get_blocking(fd)
    os.set_blocking(fd, False)
    for content in (
        b"." * 4096,
        b".",
    ):  # a page that does not fit whole is refused while single bytes still fit
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(fd, content)
    os.set_blocking(fd, was_blocking)


@contextlib.contextmanager
def full_pipe() -> Iterator[tuple[int, int]]:
    """Reading and writing end of a pipe that is full; closed afterwards, where the test did not do that."""
    ends = os.pipe()
    fill(ends[1])
    try:
        yield ends
    finally:
        for end in ends:
            with contextlib.suppress(OSError):
                os.close(end)


def drained(fd: int) -> bytes:
    """Bytes that wait in the pipe now."""
    os.set_blocking(fd, False)
    found = b""
    with contextlib.suppress(BlockingIOError):
        while chunk := os.read(fd, 65536):
            found += chunk
    return found
