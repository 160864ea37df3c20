"""Log lines and one live status line on the same terminal. The supervisor's thread only; it never waits.

A terminal that stands still, is full or has gone away ends what is shown, and nothing else.
"""

import os

from realtime.line_writer import LineWriter

_STDERR = 2  # so that stdout stays for results


class Terminal:
    """Writes to the file descriptor `fd`; the status line exists only on a real terminal."""

    def __init__(self, fd: int = _STDERR) -> None:
        self._writer = LineWriter(fd)
        self.is_live = os.isatty(fd)  # so there is a status line
        self._status = ""

    def say(self, line: str) -> None:
        """One log line, above the status line."""
        clear = "\r\x1b[2K" if self.is_live else ""
        self._writer.put(f"{clear}{line}\n{self._status}")

    def status(self, line: str) -> None:
        """Replace the status line; not while lines wait to be shown: another one comes soon."""
        if self.is_live and line != self._status and self._writer.is_idle:
            self._put_status(line)

    def end_status(self) -> None:
        """Take the status line away, and wait a second at most until everything is shown."""
        if self._status:
            self._put_status("")
        self._writer.flush()

    def _put_status(self, line: str) -> None:
        self._status = line
        self._writer.put(f"\r\x1b[2K{line}")
