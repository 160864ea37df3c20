"""A WAV file that can be read at any moment, even after kill -9: its header is right after every write.

Written without the standard library's `wave`, whose writer, once a disk is full, fails again in its destructor.
"""

import logging
import os
import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt

from realtime.regular_file import created

MAX_S = 600.0
MAX_BYTES = 2**32 - 1 - 36  # of sound: the header holds its length, with its own, in 32 bits
_WHOLE, _FLOAT = 1, 3  # format tags


def _header(rate_Hz: int, channels: int, is_float: bool, sound_bytes: int) -> bytes:
    # RIFF/WAVE: "Multimedia Programming Interface and Data Specifications 1.0", 1991; floats: its New Multimedia Data
    # Types, 1994.
    sample = 4 if is_float else 2
    frame = sample * channels
    shape = (_FLOAT if is_float else _WHOLE, channels, rate_Hz, rate_Hz * frame, frame, 8 * sample)
    return struct.pack(
        "<4sI4s4sIHHIIHH4sI", b"RIFF", 36 + sound_bytes, b"WAVE", b"fmt ", 16, *shape, b"data", sound_bytes
    )


def bytes_of(duration_s: float, rate_Hz: int, is_float: bool = False) -> float:
    """Size of a stereo file's sound, bytes."""
    return duration_s * rate_Hz * (8 if is_float else 4)


class WavFile:
    """16 bit, or floats of 32 bit. OSError when `path` cannot be written. One thread records; `close` comes after its
    end."""

    def __init__(
        self,
        path: Path,
        rate_Hz: int,
        longest_s: float = MAX_S,
        channels: int = 2,
        is_float: bool = False,
    ) -> None:
        self._path = path
        self._form = rate_Hz, channels, is_float
        self._is_float = is_float
        self._frame_bytes = channels * (4 if is_float else 2)
        self._room = min(round(longest_s * rate_Hz), MAX_BYTES // self._frame_bytes)
        self._bytes = 0
        self._fd: int | None = created(path)
        try:
            self._append(self._fd, _header(*self._form, 0))
        except OSError:
            self.close()
            raise

    @property
    def is_open(self) -> bool:
        """True when more can be recorded."""
        return self._fd is not None

    def _append(self, fd: int, content: bytes) -> None:
        rest = memoryview(content)
        while rest:
            rest = rest[os.write(fd, rest) :]

    def record(self, sound: npt.NDArray[np.float32]) -> None:
        """Append float32 of shape (n, channels), |x| <= 1 unless the file holds floats.

        At the file's limit, or when it cannot be written any more, the recording ends with one line in the log and the
        playing goes on.
        """
        if self._fd is None:
            return
        fitting = sound[: self._room]
        part = (
            fitting.astype("<f4") if self._is_float else np.round(fitting * 32767.0).astype("<i2")
        ).tobytes()
        try:
            self._append(self._fd, part)
            # The length comes after the samples: a kill or a full disk in between loses only the newest.
            os.pwrite(self._fd, _header(*self._form, self._bytes + len(part)), 0)
        except OSError as error:
            logging.warning("%s: %s; the recording ends here", self._path, error.strerror)
            self.close()
            return
        self._bytes += len(part)
        self._room -= len(part) // self._frame_bytes
        if self._room == 0:
            logging.info("%s is full; playing on without recording", self._path)
            self.close()

    def close(self) -> None:
        """Finish the file; again is harmless."""
        if self._fd is not None:
            os.close(self._fd)
            self._fd = None
