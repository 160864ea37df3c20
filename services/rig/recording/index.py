"""The index of a recording's chunks while it grows: in a file without a name, not in memory.

mcap's writer keeps an object for each chunk until the file is finished. A chunk ends every second, so that a
recording of weeks would take gigabytes of memory.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mcap.data_stream import RecordBuilder
from mcap.writer import Writer

_PIECE_BYTES = 1 << 20
_KEPT = "_Writer__chunk_indices"  # the one place where the writer keeps them: it appends, and goes through them once


class _Piece:
    """Some of the index records, as they stand in the file."""

    def __init__(self, content: bytes) -> None:
        self._content = content

    def write(self, stream: RecordBuilder) -> None:
        """Write all records, as mcap's own records do."""
        stream.write(self._content)


class IndexOnDisk:
    """Takes the place of the writer's list. OSError when the disk is full."""

    def __init__(self, folder: Path) -> None:
        self._file = tempfile.TemporaryFile(dir=folder, buffering=0)  # noqa: SIM115  closed with the recording

    def append(self, index: Any) -> None:
        """One chunk's record."""
        record = RecordBuilder()
        index.write(record)
        rest = memoryview(record.end())
        while rest:
            rest = rest[self._file.write(rest) :]

    def __iter__(self) -> Iterator[_Piece]:
        self._file.seek(0)
        while content := self._file.read(_PIECE_BYTES):
            yield _Piece(content)

    def close(self) -> None:
        """The file is gone with this."""
        self._file.close()


def keep_on_disk(writer: Writer, folder: Path) -> IndexOnDisk:
    """Let `writer`, which has written nothing yet, keep its index in `folder`. RuntimeError with another mcap."""
    if getattr(writer, _KEPT, None) != []:
        raise RuntimeError(
            "this version of mcap keeps its index elsewhere: a long recording would fill the memory"
        )
    kept = IndexOnDisk(folder)
    setattr(writer, _KEPT, kept)
    return kept
