"""Pages that are made when the site is: the page in docs/ has the words for the forge, the rest is added here."""

import inspect
import re
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import typer
from links import PAGES
from sphinx.application import Sphinx
from typer.cli import get_docs_for_click

from drumstick_lab import commands as laboratory
from rig.cli.command import app as drumstick

ROOT = Path(__file__).parents[2]
PUBLIC = ("drumstick", "drumstick.testing")
_PAGE = re.compile(r"docs/([\w/-]+)\.md")
_LINK = re.compile(r"\]\((?![a-z]+:|#)(docs/)?")


def _commands() -> str:
    group: Any = typer.main.get_command(drumstick)
    for name in ("accuracy", "soak", "lab"):
        command = group.commands[name] = typer.main.get_command(getattr(laboratory, name.upper()))
        command.name = name
    whole = get_docs_for_click(obj=group, ctx=typer.Context(group), name="drumstick").partition("\n")[2]
    return _PAGE.sub(r"[\g<0>](\1.md)", whole)


def _kind(each: object) -> str:
    if not inspect.isclass(each):
        return "function"
    return "exception" if issubclass(each, Exception) else "class"


def _names(module: str) -> str:
    home = import_module(module)
    kinds = {"function": "", "class": "", "exception": ""}
    for name in sorted(home.__all__):
        if callable(each := getattr(home, name)):
            kinds[_kind(each)] += f".. auto{_kind(each)}:: {module}.{name}\n\n"
    heads = zip(("Functions", "Classes", "Exceptions"), kinds.values(), strict=True)
    parts = [f"\n### {head}\n\n```{{eval-rst}}\n{names}```\n" for head, names in heads if names]
    return f"\n## `import {module}`\n" + "".join(parts)


def _from_root(name: str) -> str:
    text = (ROOT / name).read_text(encoding="utf-8").partition("\n")[2]
    return _LINK.sub(lambda link: "](" if link[1] else "](../", text)


MADE = {"commands": _commands, "api": lambda: "".join(map(_names, PUBLIC))} | {
    page: partial(_from_root, name) for name, page in PAGES.items() if page != "index"
}


def _add(app: Sphinx, page: str, source: list[str]) -> None:
    if page in MADE:
        source[0] += "\n" + MADE[page]()


def _link_pages(app: Sphinx, kind: str, name: str, each: Any, options: Any, lines: list[str]) -> None:
    """Make links of the pages that a docstring names, and leave out what a named tuple says of its fields."""
    lines[:] = [
        _PAGE.sub(r":doc:`\1`", line) for line in lines if not line.startswith("Alias for field number")
    ]


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("source-read", _add)
    app.connect("autodoc-process-docstring", _link_pages)
    return {"parallel_read_safe": True}
