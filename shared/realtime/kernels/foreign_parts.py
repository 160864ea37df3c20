"""Parts of a fold that another package gives: its plain functions, compiled into the kernels, and told apart by source.

A stored kernel is found again by the types of its arguments. The record of a foreign part has a field that is named by
a hash of the package's sources, so a changed package is another type, and no kernel with its former code is taken.
Ordinary Python threads only.
"""

import functools
import hashlib
import inspect
import uuid
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from realtime.kernels.jit import overload
from realtime.records import Record


@functools.cache
def _sources(module: str) -> bytes:
    # All that lies in the package that the module is in, or the module if it stands alone.
    top = module.partition(".")[0]
    if top == "__main__":  # a notebook's, a program's: may be another at any time
        return uuid.uuid4().bytes
    spec = find_spec(top)
    if spec is None:
        raise ModuleNotFoundError(f"there is no module {top}")
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    files = sorted(path for folder in folders for path in folder.rglob("*.py")) or [Path(str(spec.origin))]
    return b"".join(path.name.encode() + path.read_bytes() for path in files)


def _text_of(function: Callable[..., Any]) -> str:
    # What tells it from another function of its module: a factory makes many of one text.
    code, cells = function.__code__, inspect.getclosurevars(function).nonlocals
    return f"{code.co_code!r}{code.co_consts!r}{code.co_names!r}{cells!r}"


def source_of(module: str, functions: Iterable[Callable[..., Any]]) -> str:
    """A hash of the package that `module` is in, and of these functions."""
    texts = "".join(map(_text_of, functions))
    return hashlib.sha256(_sources(module) + texts.encode()).hexdigest()[:16]


def record_of(name: str, fields: dict[str, Any], base: type[Record], source: str) -> type[Record]:
    """A record with these fields after those of `base`, and one that no kernel reads, named by `source_of`."""
    annotations = fields | {f"source_{source}": int}
    return type(name, (base,), {"__annotations__": annotations, "__module__": __name__})


def require_arguments(function: Callable[..., Any], what: str, known: Iterable[str]) -> None:
    """ValueError unless `function` is one in Python's own text whose arguments are among `known`."""
    if not inspect.isfunction(function):
        raise ValueError(f"{what} is a {type(function).__name__}: give a plain function, not compiled yet")
    for asked in inspect.signature(function).parameters:
        if asked not in known:
            raise ValueError(f"{what} asks for `{asked}`; there are: {', '.join(known)}")


def inner(body: Callable[..., Any]) -> Callable[..., Any]:
    """`body` for kernels to call, compiled into each of them; no kernel by itself, with no place in the store."""
    names = ", ".join(inspect.signature(body).parameters)
    namespace: dict[str, Any] = {"body": body}
    # numba compares names of arguments, and takes no *args here.
    exec(f"def placeholder({names}): raise TypeError('for compiled code')", namespace)
    exec(f"def choose({names}): return body", namespace)
    overload(namespace["placeholder"])(namespace["choose"])
    return namespace["placeholder"]


def part_function(text: str, part: str, names: dict[str, Any]) -> Callable[..., Any]:
    """The function that this text defines, with `names` in its sight, as a part of that name for a fold."""
    namespace = dict(names)
    exec(text, namespace)
    made: Callable[..., Any] = namespace[text.partition("def ")[2].partition("(")[0]]
    made.__module__, made.__qualname__ = __name__, f"{part}.{made.__name__}"
    return inner(made)


def call_of(function: Callable[..., Any], given: dict[str, str]) -> str:
    """Text of a call of `hook`, a name for `function`: each argument that it asks for as `given` spells it."""
    return f"hook({', '.join(given[asked] for asked in inspect.signature(function).parameters)})"
