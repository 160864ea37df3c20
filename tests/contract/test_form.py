"""Form that the product keeps: short argument lists, and docstrings whose first line stands alone."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MAX_ARGUMENTS = 8
PRODUCT = ("shared", "services", "lab")
# Headless clauses and genitive fragments: "What the servo tells", "Of one stream".
QUESTIONS = ("What", "How", "Who", "Whose", "Which", "Where", "When", "Why", "Whether")
HEADLESS = (
    *QUESTIONS, "Of", "As", "All that", "Those", "From now",
    "Before", "After", "Is", "Are", "Has", "Does", "May", "Can", "It", "They",
)  # fmt: skip


def product(*folders: str) -> list[Path]:
    return [path for folder in folders or PRODUCT for path in sorted((ROOT / folder).rglob("*.py"))]


def long_argument_lists(tree: ast.Module) -> list[str]:
    """Functions that take more arguments than anybody can keep in mind, self and cls not counted."""
    found: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            taken = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
            if len([name for name in taken if name not in ("self", "cls")]) > MAX_ARGUMENTS:
                found.append(node.name)
    return found


def is_headless(docstring: str, words: tuple[str, ...] = HEADLESS) -> bool:
    return docstring.startswith(tuple(f"{word} " for word in words))


def test_no_function_takes_more_than_eight_arguments() -> None:
    found = {
        path.name: long_argument_lists(ast.parse(path.read_text(encoding="utf-8"))) for path in product()
    }
    assert {name: functions for name, functions in found.items() if functions} == {}
    nine = ast.parse("def f(self, a, b, c, d, *, e, g, h, i, j): ...")
    assert long_argument_lists(nine) == ["f"]


def headless(path: Path, words: tuple[str, ...] = HEADLESS) -> list[str]:
    """Module, classes and functions of a file whose docstrings are headless."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    documented = [n for n in ast.walk(tree) if isinstance(n, ast.Module | ast.ClassDef | ast.FunctionDef)]
    return [
        f"{path.relative_to(ROOT).as_posix()}: {getattr(node, 'name', 'module')}"
        for node in documented
        if is_headless(ast.get_docstring(node) or "", words)
    ]


def test_a_docstring_begins_with_a_noun_or_a_verb() -> None:
    assert [each for path in product() for each in headless(path)] == []
    assert [each for path in product("tests", "docs") for each in headless(path, QUESTIONS)] == []
    assert is_headless("What the servo tells: strikes and releases.")
