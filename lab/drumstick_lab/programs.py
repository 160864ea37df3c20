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


def programs() -> dict[str, str]:
    """Name -> the first sentence of what it is and how it is started."""
    found: dict[str, str] = {}
    for folder in _FOLDERS:
        for path in sorted((_PACKAGE / folder).rglob("*.py")):
            words, name = _docstring(path), _spoken(path)
            if re.search(rf"drumstick lab {re.escape(name)}(?![\w-])", words):
                found[name] = re.split(r"[:?.] ", words, maxsplit=1)[0]
    return found


def module_of(name: str) -> str:
    """The module of a program, whose name may be written with - or _. Raises LookupError."""
    for folder in _FOLDERS:
        for path in (_PACKAGE / folder).rglob(f"{name.replace('-', '_')}.py"):
            if _spoken(path) in programs():
                return _module(path)
    raise LookupError(name)
