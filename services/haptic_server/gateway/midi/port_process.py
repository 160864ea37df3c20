"""The MIDI library in a process of its own: it holds the interpreter while it waits, and it ends its process by itself.

(rtmidi2 1.5 releases no GIL, and an error of a driver in some of its calls is a C++ exception that nobody catches.)
Whole messages go down a pipe, what became of the port comes back as lines of JSON. When the pipe ends, because the
gateway ended or was killed, that process ends every note that it knows to sound. One thread, which never waits here.
"""

import json
import os
import select
import subprocess
import time
from collections.abc import Callable, Sequence
from typing import Any

from haptic_server.gateway.midi.encoding import MESSAGE_BYTES

RETRY_S = 2.0
_END_WITHIN_S = 1.0


class PortProcess:
    """`words` are the command line of the process that has the library, started by the first `poll`.

    `hear` gets each message that a process which listens has heard.
    """

    def __init__(self, words: Sequence[str], hear: Callable[[bytes], None] | None = None) -> None:
        self._words = list(words)
        self._hear = hear
        self._process: subprocess.Popen[bytes] | None = None
        self._start_at_s = float("-inf")
        self._partial = b""
        self._is_open = False
        self._told_away = False

    @property
    def is_open(self) -> bool:
        """True when the process has reported that it has the port."""
        return self._is_open

    def poll(self, now_s: float) -> str:
        """Start the process when it is due, and read what it says. A port that is away is told once."""
        if self._process is None:
            if now_s >= self._start_at_s:
                self._start(now_s)
            return ""
        news = ""
        for line in self._lines():
            news = self._take(line) or news
        status = self._process.poll()
        if status is not None:
            self._let_go()
            news = self._away(f"the MIDI library ended with status {status}; trying again") or news
        return news

    def wait(self, timeout_s: float) -> None:
        """Sleep until the process has said something, or for so long."""
        if self._process is None or self._process.stdout is None:
            time.sleep(timeout_s)
        else:
            select.select([self._process.stdout], [], [], timeout_s)

    def send(self, messages: bytes) -> bool:
        """Send whole messages; a process that no longer takes them is ended, and another one started later."""
        assert len(messages) % MESSAGE_BYTES == 0
        if self._process is None or self._process.stdin is None or not self._is_open:
            return False
        try:
            # Far less than a pipe takes at once: either all of it is written or nothing.
            os.write(self._process.stdin.fileno(), messages)
        except BlockingIOError:
            self._process.kill()
            self._is_open = False
            return False
        except BrokenPipeError:
            self._is_open = False
            return False
        return True

    def close(self) -> None:
        """The end of the pipe asks the process to end its notes and itself; it is killed after a second."""
        if self._process is None:
            return
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(_END_WITHIN_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._let_go()

    def _start(self, now_s: float) -> None:
        self._start_at_s = now_s + RETRY_S
        self._process = subprocess.Popen(
            self._words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # JACK and ALSA write lines there whenever something is not as they like it
            bufsize=0,
        )
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            os.set_blocking(pipe.fileno(), False)

    def _let_go(self) -> None:
        if self._process is not None:
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe is not None:
                    pipe.close()
        self._process = None
        self._partial = b""
        self._is_open = False

    def _lines(self) -> list[bytes]:
        assert self._process is not None
        assert self._process.stdout is not None
        while chunk := self._process.stdout.read(65536):
            self._partial += chunk
        *lines, self._partial = self._partial.split(b"\n")
        return lines

    def _take(self, line: bytes) -> str:
        report: dict[str, Any] = json.loads(line)
        if "heard" in report:
            if self._hear is not None:
                self._hear(bytes(report["heard"]))
            return ""
        self._is_open = bool(report["open"])
        if not self._is_open:
            return self._away(str(report["words"]))
        self._told_away = False
        return str(report["words"])

    def _away(self, words: str) -> str:
        if self._told_away:
            return ""
        self._told_away = True
        return words
