"""The log: plain short lines on stderr; whoever runs several services adds its own prefix.

Where stderr is the journal's, each line begins with its level as sd-daemon(3) has it, `<3>` for an error and `<4>` for
a warning, so that `journalctl -p warning` finds them. Ordinary threads only. Logging never waits for who reads it.
"""

import atexit
import contextlib
import logging
import os
import sys
import threading
import traceback
from collections.abc import Mapping
from types import TracebackType
from typing import NoReturn

from realtime.line_writer import LineWriter

_STDERR = 2


def is_journal(environment: Mapping[str, str] = os.environ, fd: int = _STDERR) -> bool:
    """True when this descriptor is the journal's own; JOURNAL_STREAM alone also reaches children that have a pipe."""
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
    """One message to stderr, for those who have no log. Blocks as printing does; nobody fails because it is lost."""
    flush_log()  # what was logged before stands before it
    try:
        print(marked(level, words) if is_journal() else words, file=sys.stderr, flush=True)
    except OSError:
        # What stays in its buffer would fail once more at the process' end, and change the exit status.
        with contextlib.suppress(OSError):
            sys.stderr.close()
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115  open until the process ends


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


class _Lines(logging.Handler):
    def __init__(self, formatter: logging.Formatter) -> None:
        super().__init__()
        self.setFormatter(formatter)
        # Closed since the process began, the number may be another file's by now.
        self.writer = LineWriter(_STDERR if sys.stderr is not None else None, self._worded)

    def _worded(self, words: str) -> str:
        return self.format(logging.LogRecord("log", logging.WARNING, "", 0, words, None, None)) + "\n"

    def emit(self, record: logging.LogRecord) -> None:
        try:
            words = self.format(record)
        except Exception:  # noqa: BLE001  arguments that do not fit the message must not end who logs it
            fault = traceback.format_exc().rstrip()
            words = f"{record.pathname}:{record.lineno} logs what cannot be put in words:\n{fault}"
        self.writer.put(f"{words}\n")


def open_log(names_level: bool = False) -> None:
    """Send this process's log to stderr, with what exceptions that nobody caught say. Once, at its start.

    `names_level`: where no journal knows it, say it. The process' end waits a second at most for who reads the log.
    """
    lines = _Lines(_Plain(names_level))
    logging.basicConfig(level=logging.INFO, handlers=[lines])
    logging.captureWarnings(True)
    # Python's own hooks print, and so would wait for a reader.
    sys.excepthook, threading.excepthook, sys.unraisablehook = _uncaught, _uncaught_in_thread, _unraisable
    atexit.register(lines.writer.flush)


def flush_log() -> None:
    """Write what waits, for a second at most."""
    for handler in logging.getLogger().handlers:
        if isinstance(handler, _Lines):
            handler.writer.flush()


def end_process(status: int) -> NoReturn:
    """End this process now, with its log written; the last call of a service that has closed what it opened.

    Python's own end takes every compiled kernel apart: half a second of processor time, on a busy machine many seconds,
    in which whoever asked the service to stop waits. Audio libraries may wait there for a server that is dead.
    """
    flush_log()
    os._exit(status)


def _uncaught(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    logging.critical("a fault that ends this process: %s", kind.__name__, exc_info=(kind, error, trace))


def _uncaught_in_thread(failure: threading.ExceptHookArgs) -> None:
    if failure.exc_type is SystemExit or failure.exc_value is None:
        return
    name = "?" if failure.thread is None else failure.thread.name
    traced = (failure.exc_type, failure.exc_value, failure.exc_traceback)
    logging.critical("a fault that ends the thread %s: %s", name, failure.exc_type.__name__, exc_info=traced)


def _unraisable(failure: "sys.UnraisableHookArgs") -> None:
    words = failure.err_msg or "a fault that was ignored in"
    if failure.exc_value is None:
        logging.error("%s %r: %s", words, failure.object, failure.exc_type.__name__)
    else:
        traced = (failure.exc_type, failure.exc_value, failure.exc_traceback)
        logging.error("%s %r", words, failure.object, exc_info=traced)
