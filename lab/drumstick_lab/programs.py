"""Programs of the laboratory: every module whose docstring says how `drumstick lab` starts it."""

import ast
import re
from pathlib import Path

_PACKAGE = Path(__file__).parent
_FOLDERS = ("benchmarks", "pages")


def _spoken(path: Path) -> str:
    return path.stem.replace("_", "-")


def _docstring(path: Path) -> str:
    return " ".join((ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split())


def _module(path: Path) -> str:
    return ".".join((_PACKAGE.name, *path.relative_to(_PACKAGE).with_suffix("").parts))


def _is_program(path: Path) -> bool:
    return re.search(rf"drumstick lab {re.escape(_spoken(path))}(?![\w-])", _docstring(path)) is not None


def programs() -> dict[str, str]:
    """Name -> the first sentence of what it is and how it is started."""
    found: dict[str, str] = {}
    for folder in _FOLDERS:
        for path in sorted((_PACKAGE / folder).rglob("*.py")):
            if _is_program(path):
                found[_spoken(path)] = re.split(r"[:?.] ", _docstring(path), maxsplit=1)[0]
    return found


def _path_of(name: str) -> Path:
    for folder in _FOLDERS:
        for path in (_PACKAGE / folder).rglob(f"{name.replace('-', '_')}.py"):
            if _is_program(path):
                return path
    raise LookupError(name)


def module_of(name: str) -> str:
    """The module of a program, whose name may be written with - or _. Raises LookupError."""
    return _module(_path_of(name))


def file_of(name: str) -> str:
    """The file of a program, from the root of the checkout. Raises LookupError."""
    return _path_of(name).relative_to(_PACKAGE.parent.parent).as_posix()


def words_of(name: str) -> str | None:
    """The docstring of a program that reads no options; None where it has a help of its own. Raises LookupError."""
    text = _path_of(name).read_text(encoding="utf-8")
    return None if "argparse" in text else ast.get_docstring(ast.parse(text))
