"""Hash of the sources that a result measures, by which a stale one is known."""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, cast

from drumstick_lab.checkout import ROOT

_WITH_DOCSTRING = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def _note(node: Any, said: list[str]) -> None:
    # By hand, as ast.dump differs between versions of Python: what is empty is left out.
    if isinstance(node, ast.AST):
        said.append(type(node).__name__)
        for name, value in ast.iter_fields(node):
            if name == "body" and isinstance(node, _WITH_DOCSTRING) and ast.get_docstring(node) is not None:
                value = value[1:]
            if value is not None and value != []:
                said.append(name)
                _note(value, said)
    elif isinstance(node, list):
        for each in cast("list[Any]", node):
            _note(each, said)
        said.append(";")
    else:
        said.append(repr(node))


def _content(file: Path) -> bytes:
    if file.suffix != ".py":
        return file.read_bytes()
    said: list[str] = []
    _note(ast.parse(file.read_bytes()), said)
    return "\n".join(said).encode()


def files_of(path: str) -> Iterator[Path]:
    """A file of the checkout, or all in a folder, in order. Raises FileNotFoundError."""
    found = ROOT / path
    if not found.exists():
        raise FileNotFoundError(found)
    files = sorted(found.rglob("*")) if found.is_dir() else [found]
    return (file for file in files if file.is_file() and "__pycache__" not in file.parts)


@cache
def _hash_of(path: str) -> bytes:
    digest = hashlib.sha256()
    for file in files_of(path):
        digest.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + _content(file) + b"\0")
    return digest.digest()


def source_hash(paths: tuple[str, ...]) -> str:
    """16 digits for these files and folders of the checkout. Comments, docstrings and layout of Python do not count.

    Raises FileNotFoundError.
    """
    return hashlib.sha256(b"".join(_hash_of(path) for path in paths)).hexdigest()[:16]
