"""Mutants of a source file: what poodle's mutators make of it, less what says nothing about tests.

Left out are words for people (a text with a space in it: tests hold what must be said, not how), strings inside
f-strings (Python 3.11 does not know where they begin), in annotations and in a record's type, and in compiled code
whatever numba would not compile, such as None for a number, or what reads beside an array of one: nobody could ever
play it, so killing it is no merit.
"""

import ast
import difflib
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

from poodle.data_types import FileMutation
from poodle.mutate import builtin_mutators
from poodle.util import mutate_lines

_COMPILERS = {"njit", "overload", "only_with", "cfunction"}


@dataclass(frozen=True)
class Mutant:
    """One change: `removed` and `added` are its lines without their margins, `source` is the whole file with it."""

    module: str
    path: str
    line: int
    kind: str
    removed: str
    added: str
    source: str

    @property
    def where(self) -> str:
        return f"{self.path}:{self.line}"

    @property
    def diff(self) -> list[str]:
        return [f"- {self.removed}", f"+ {self.added}"]


def _is_kernel(function: ast.FunctionDef) -> bool:
    calls = [each.func for each in function.decorator_list if isinstance(each, ast.Call)]
    return any(isinstance(call, ast.Name) and call.id in _COMPILERS for call in calls)


def _makes_a_type(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "dtype"


class _Places:
    """Places in a file: lines of kernels, calls that are a statement, indices, texts that are left alone."""

    def __init__(self, tree: ast.Module) -> None:
        self.kernels: set[int] = set()
        self.statements: set[tuple[int, int]] = set()
        self.indices: set[tuple[int, int]] = set()
        self.texts: set[tuple[int, int]] = set()
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and _is_kernel(node):
                first = min(each.lineno for each in node.decorator_list)
                self.kernels.update(range(first, (node.end_lineno or node.lineno) + 1))
            elif isinstance(node, ast.Expr):
                self.statements.add((node.lineno, node.col_offset))
            elif isinstance(node, ast.Subscript):
                self.indices.add((node.slice.lineno, node.slice.col_offset))
            self._leave_texts(node)

    def _leave_texts(self, node: ast.AST) -> None:
        within = [node] if isinstance(node, ast.JoinedStr) or _makes_a_type(node) else []
        within += [each for name in ("annotation", "returns") if (each := getattr(node, name, None))]
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value.strip():
            within.append(node)
        for root in within:
            for each in ast.walk(root):
                if isinstance(each, ast.Constant):
                    self.texts.add((each.lineno, each.col_offset))

    def says_something(self, change: FileMutation) -> bool:
        begins = (change.lineno, change.col_offset)
        if change.mutator_name == "String":
            return begins not in self.texts
        if change.lineno in self.kernels:
            if change.mutator_name == "FuncCall":
                return begins in self.statements
            if change.mutator_name == "Number":
                return begins not in self.indices
            return change.mutator_name not in ("DictArray", "Return", "Decorator")
        return True


def mutants_of(module: str, root: Path, path: str) -> Iterator[Mutant]:
    """Every mutant of this file that is another program than the file, each once."""
    text = (root / path).read_text(encoding="utf-8")
    tree = ast.parse(text)
    places, seen = _Places(tree), {ast.dump(tree)}
    # ast counts bytes, poodle letters: in Latin-1 each byte is one.
    lines = [line + "\n" for line in text.encode().decode("latin-1").split("\n")]
    settings = SimpleNamespace(mutator_opts={})
    for make in builtin_mutators.values():
        mutator = make(config=settings, echo=print)
        for change in mutator.create_mutations(parsed_ast=ast.parse(text), file_lines=text.splitlines()):
            if not places.says_something(change):
                continue
            change.text = change.text.encode().decode("latin-1")
            changed = mutate_lines(change, lines)
            source = "".join(changed).encode("latin-1").decode()[:-1]
            try:
                program = ast.dump(ast.parse(source))
            except SyntaxError:
                continue
            if program not in seen:
                seen.add(program)
                yield _mutant(module, path, change, text, source)


def _mutant(module: str, path: str, change: FileMutation, text: str, source: str) -> Mutant:
    removed: list[str] = []
    added: list[str] = []
    for line in difflib.ndiff(text.splitlines(), source.splitlines()):
        if line[0] in "-+":
            (removed if line[0] == "-" else added).append(line[2:].strip())
    first = next(at for at, (a, b) in enumerate(_side_by_side(text, source), 1) if a != b)
    return Mutant(module, path, first, change.mutator_name, " ".join(removed), " ".join(added), source)


def _side_by_side(text: str, source: str) -> Iterator[tuple[str, str]]:
    before, after = text.splitlines(), source.splitlines()
    longest = max(len(before), len(after))
    yield from zip(
        before + [""] * (longest - len(before)), after + [""] * (longest - len(after)), strict=True
    )


def drawn(population: dict[str, list[Mutant]], count: int, seed: int) -> list[Mutant]:
    """`count` of them: from each module in proportion to its own, but a third of an even share at least.

    A module's draw depends on the seed and its own mutants only, and a larger one begins with a smaller one.
    """
    least = max(1, count // (3 * len(population)))
    total = sum(len(mutants) for mutants in population.values())
    rest = max(0, count - sum(min(least, len(mutants)) for mutants in population.values()))
    chosen: list[Mutant] = []
    passed = 0
    for module, mutants in population.items():
        share = round(rest * (passed + len(mutants)) / total) - round(rest * passed / total)
        passed += len(mutants)
        shuffled = mutants.copy()
        random.Random(f"{seed} {module}").shuffle(shuffled)
        chosen += shuffled[: min(least, len(mutants)) + share]
    return chosen
