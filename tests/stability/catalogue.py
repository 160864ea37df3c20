"""The catalogue of hard cases, and which tests show them.

Each case has a test that runs the naive method and asserts that it fails as the case says, and that ours does not.
`@shows` ties a test to its case, wherever the test stands; docs/hard-cases.md is made from both.
"""

import ast
import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple, get_args

import pytest

from stability.case import Case, Subject
from stability.cases import effects, mesh, servo, stick, wire

CASES: tuple[Case, ...] = (*stick.CASES, *servo.CASES, *mesh.CASES, *effects.CASES, *wire.CASES)
SUBJECTS: tuple[Subject, ...] = get_args(Subject)
Half = Literal["naive", "ours"]
HALVES: tuple[Half, ...] = get_args(Half)
TESTS = Path(__file__).resolve().parents[1]
_NAMES = frozenset(case.name for case in CASES)


def shows(name: str, *halves: Half) -> pytest.MarkDecorator:
    """This test shows the case: that the naive method fails and that ours does not, or only the halves that are named.

    LookupError for a case that is not in the catalogue: then its file is not collected.
    """
    if name not in _NAMES:
        raise LookupError(f"no hard case is called {name!r}: see tests/stability/cases")
    return pytest.mark.shows(name, *(halves or HALVES))


class Tie(NamedTuple):
    """`test` in the file `path`, below tests/, shows these halves of `case`."""

    case: str
    halves: tuple[str, ...]
    path: Path
    test: str


def _marked(path: Path) -> Iterator[Tie]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.FunctionDef):
            continue
        for mark in node.decorator_list:
            if isinstance(mark, ast.Call) and isinstance(mark.func, ast.Name) and mark.func.id == "shows":
                name, *halves = (ast.literal_eval(argument) for argument in mark.args)
                yield Tie(name, tuple(halves) or HALVES, path.relative_to(TESTS), node.name)


@functools.cache
def ties() -> tuple[Tie, ...]:
    """Every tie in the suite, by file. Read from the source: nothing is imported, whatever is selected to run."""
    return tuple(tie for path in sorted(TESTS.rglob("test_*.py")) for tie in _marked(path))
