"""Log lines and one live status line on the same terminal. The supervisor's thread only."""

import sys
from typing import TextIO


class Terminal:
    """Writes to `out` (stderr, so that stdout stays for results); the status line exists only on a real terminal."""

    def __init__(self, out: TextIO = sys.stderr) -> None:
        self._out = out
        self._live = out.isatty()
        self._status = ""

    def say(self, line: str) -> None:
        """One log line, above the status line."""
        clear = "\r\x1b[2K" if self._live else ""
        self._out.write(f"{clear}{line}\n{self._status}")
        self._out.flush()

    def status(self, line: str) -> None:
        """Replace the status line."""
        if self._live and line != self._status:
            self._status = line
            self._out.write(f"\r\x1b[2K{line}")
            self._out.flush()

    def end_status(self) -> None:
        """Take the status line away."""
        self.status("")
