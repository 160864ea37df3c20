"""The log: plain short lines on stderr; whoever runs several services adds its own prefix.

Where stderr is the journal's, each line begins with its level as sd-daemon(3) has it, `<3>` for an error and `<4>` for
a warning, so that `journalctl -p warning` finds them. Ordinary threads only.
"""

import logging
import os
import sys
from collections.abc import Mapping


def is_journal(environment: Mapping[str, str] = os.environ, fd: int = 2) -> bool:
    """Whether this descriptor is the journal's own; JOURNAL_STREAM alone also reaches children that have a pipe."""
    try:
        found = os.fstat(fd)
    except OSError:
        return False
    return environment.get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"


def marked(level: int, words: str) -> str:
    """These lines as the journal wants them, of this level of `logging`."""
    number = 3 if level >= logging.ERROR else 4 if level >= logging.WARNING else 6
    return "\n".join(f"<{number}>{line}" for line in words.split("\n"))


def say(level: int, words: str) -> None:
    """One message to stderr, for those who have no log. Blocks as printing does."""
    print(marked(level, words) if is_journal() else words, file=sys.stderr, flush=True)


class _Plain(logging.Formatter):
    def __init__(self, names_level: bool) -> None:
        super().__init__()
        self._names_level, self._is_journal = names_level, is_journal()

    def format(self, record: logging.LogRecord) -> str:
        text = super().format(record)
        if self._is_journal:
            return marked(record.levelno, text)
        is_named = self._names_level and record.levelno >= logging.WARNING
        return f"{record.levelname}: {text}" if is_named else text


def open_log(names_level: bool = False) -> None:
    """Send this process's log to stderr. Once, at its start. `names_level`: where no journal knows it, say it."""
    stream = logging.StreamHandler()
    stream.setFormatter(_Plain(names_level))
    logging.basicConfig(level=logging.INFO, handlers=[stream])
    logging.captureWarnings(True)
