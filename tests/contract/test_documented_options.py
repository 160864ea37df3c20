"""Every option that the documentation gives to a `drumstick` command is one of that command's."""

import re
from pathlib import Path
from typing import Any

import pytest
import typer.main

from drumstick_lab import commands as laboratory
from rig.cli.command import app

ROOT = Path(__file__).parents[2]
PAGES = [
    *ROOT.glob("*.md"),
    *(ROOT / "docs").rglob("*.md"),
    *(ROOT / "deploy").rglob("*.service"),
    *(ROOT / "lab").rglob("*.template.md"),
]
CALL = re.compile(r"drumstick((?: [a-z-]+)+)(?:\\\n|[^`#;|&()\n])*")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")


def options() -> dict[str, set[str]]:
    """Options of each command, by its words."""
    whole: Any = typer.main.get_command(app)
    for name in ("accuracy", "soak"):  # of the laboratory: `drumstick` hands their options on
        whole.commands[name] = typer.main.get_command(getattr(laboratory, name.upper()))
    found: dict[str, set[str]] = {}
    left = [("", whole)]
    for words, command in left:
        found[words] = {option for each in command.params for option in (*each.opts, *each.secondary_opts)}
        left += [(f"{words} {name}", each) for name, each in getattr(command, "commands", {}).items()]
    return {words: own | {"--help"} for words, own in found.items()}


def wrong(page: str, known: dict[str, set[str]]) -> list[str]:
    """Options that a page gives to a command that has no such option, with the command."""
    found: list[str] = []
    for call in CALL.finditer(page):
        words = call[1]
        while words not in known:
            words = words.rpartition(" ")[0]
        if words not in ("", " lab"):  # programs of the laboratory have parsers of their own
            found += [
                f"drumstick{words} {option}"
                for option in OPTION.findall(call[0])
                if option not in known[words]
            ]
    return found


def test_every_option_in_the_docs_exists() -> None:
    known = options()
    there = {str(page.relative_to(ROOT)): wrong(page.read_text(encoding="utf-8"), known) for page in PAGES}
    assert {page: found for page, found in there.items() if found} == {}


@pytest.mark.parametrize(
    ("page", "found"),
    [
        ("`drumstick up --scene roll`, `git log --oneline`", []),
        ("`drumstick up --loud`", ["drumstick up --loud"]),
        ("`drumstick preset save x --rig-file f --json`", ["drumstick preset save --json"]),
        ("drumstick up \\\n  --loud", ["drumstick up --loud"]),
        ("`drumstick soak --real-time`, `drumstick lab fuzz --seconds 3`", []),
    ],
)
def test_a_wrong_option_is_seen(page: str, found: list[str]) -> None:
    assert wrong(page, options()) == found
