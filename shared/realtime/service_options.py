"""Options of a service's process: each service declares its struct, and gets one as JSON, its only argument.

Whoever starts a service fills in the struct; the service reads it back. Any thread.
"""

import sys
from pathlib import Path
from typing import Any, TypeVar

import msgspec


class ServiceOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of the structs. A `__post_init__` raises ValueError for what types and ranges cannot say."""


Kind = TypeVar("Kind", bound=ServiceOptions)


def command(module: str, options: ServiceOptions) -> list[str]:
    """Command line that runs `python -m module` with these options. ValueError for text that is not UTF-8."""
    try:
        return [sys.executable, "-m", module, msgspec.json.encode(options, enc_hook=_as_text).decode()]
    except UnicodeEncodeError as error:
        raise ValueError(f"{error.object!a} is not UTF-8 text: rename the file or folder") from None


def read(kind: type[Kind], text: str) -> Kind:
    """The struct in this JSON text; ValueError, with the field, where it is none."""
    return msgspec.json.decode(text, type=kind, dec_hook=_from_text)


def options_of_process(kind: type[Kind], module: str) -> Kind:
    """The struct that this process was given. Ends the process with status 2 and one line when there is none."""
    try:
        if len(sys.argv) != 2:
            raise ValueError(f"{len(sys.argv) - 1} arguments were given")
        return read(kind, sys.argv[1])
    except ValueError as error:
        print(
            f"{module}: {error}; its one argument is a JSON object, as `drumstick` gives it", file=sys.stderr
        )
        raise SystemExit(2) from None


def _as_text(value: object) -> str:
    if isinstance(value, Path):
        return str(value)
    raise NotImplementedError(f"{type(value).__name__} cannot be an option of a service")


def _from_text(kind: type, text: object) -> Any:
    if kind is Path:
        if isinstance(text, str):
            return Path(text)
        raise ValueError(f"Expected a path as `str`, got `{type(text).__name__}`")
    raise NotImplementedError(f"{kind.__name__} cannot be an option of a service")
