"""The log: plain short lines on stderr; whoever runs several services adds its own prefix."""

import logging


class _Plain(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        text = record.getMessage()
        return text if record.levelno < logging.WARNING else f"{record.levelname}: {text}"


def open_log() -> None:
    """Send this process's log to stderr. Once, at its start."""
    stream = logging.StreamHandler()
    stream.setFormatter(_Plain())
    logging.basicConfig(level=logging.INFO, handlers=[stream])
    logging.captureWarnings(True)
