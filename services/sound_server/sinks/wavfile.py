"""A WAV file that can be read at any moment, even after kill -9: its header is right after every write."""

import logging
import wave
from pathlib import Path

import numpy as np
import numpy.typing as npt

LONGEST_S = 600.0


class WavFile:
    """16-bit stereo. OSError when `path` cannot be written. One thread writes; `close` comes after its end."""

    def __init__(self, path: Path, rate_Hz: int, longest_s: float = LONGEST_S) -> None:
        self._path = path
        self._room = round(longest_s * rate_Hz)
        self._file = path.open("wb")
        self._wave: wave.Wave_write | None = wave.open(self._file, "wb")  # noqa: SIM115
        self._wave.setnchannels(2)
        self._wave.setsampwidth(2)
        self._wave.setframerate(rate_Hz)
        self._write(np.zeros((0, 2), np.float32))

    def _write(self, sound: npt.NDArray[np.float32]) -> None:
        if self._wave is None:
            return
        # writeframes puts the new length into the header after the samples: a kill in between loses only the newest.
        self._wave.writeframes(np.round(sound * 32767.0).astype("<i2").tobytes())
        self._file.flush()

    def record(self, sound: npt.NDArray[np.float32]) -> None:
        """Append float32 of shape (n, 2), |x| <= 1. At the file's limit, or when it cannot be written any more, the
        recording ends with one line in the log and the playing goes on."""
        if self._wave is None:
            return
        part = sound[: self._room]
        try:
            self._write(part)
        except OSError as error:
            logging.warning("%s: %s; the recording ends here", self._path, error.strerror)
            self.close()
            return
        self._room -= len(part)
        if self._room == 0:
            logging.info("%s is full; playing on without recording", self._path)
            self.close()

    def close(self) -> None:
        """Finish the file; again is harmless."""
        if self._wave is None:
            return
        recording, self._wave = self._wave, None
        try:
            recording.close()
            self._file.close()
        except OSError as error:
            logging.warning("%s: %s", self._path, error.strerror)
