"""The secret in the page's address: whoever has it may tune. Kept in a file, so the address outlives a restart."""

import os
import re
import secrets
from pathlib import Path

from realtime.regular_file import read_text

_SHAPE = re.compile(r"[A-Za-z0-9_-]{32,128}")
_MAX_BYTES = 200


class TokenFileError(Exception):
    """The token file cannot be used; the message says which, why and what to do."""


def token_of(path: Path) -> str:
    """The token in `path`; made, with its folder, when missing (mode 0600). Raises TokenFileError. Any thread."""
    try:
        if not path.exists():
            _create(path)
        return _read(path)
    except (OSError, UnicodeDecodeError) as error:
        raise TokenFileError(f"token file {path}: {error}") from None


def _create(path: Path) -> None:
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    descriptor = os.open(draft, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
    try:
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            file.write(secrets.token_urlsafe(32) + "\n")
            file.flush()
            os.fsync(file.fileno())
        # A link appears whole or not at all, and never replaces what another panel just made.
        os.link(draft, path)
    except FileExistsError:
        return
    finally:
        draft.unlink()


def _read(path: Path) -> str:
    if path.stat().st_mode & 0o077:
        raise TokenFileError(
            f"token file {path} can be read by others: chmod 600 it, or delete it for a new token"
        )
    token = read_text(path, _MAX_BYTES).strip()
    if not _SHAPE.fullmatch(token):
        raise TokenFileError(f"token file {path} holds no token: delete it, and the panel makes a new one")
    return token
