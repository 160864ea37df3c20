"""The children of a folder, its files and sub-folders, import one another in one direction: they form no circle."""

import ast
import graphlib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
Pairs = set[tuple[str, str]]  # who imports, what

# What closes the circles that there are: no other may come, and what is gone goes from here too.
BACK: Mapping[str, Pairs] = {
    "haptic_server": {("device", "servo")},
    "haptic_server.servo": {("event_output", "force"), ("memory", "force")},
    "rig": {
        ("figures", "machine"), ("machine", "network"), ("machine", "supervision"), ("requested_scene", "supervision"),
        ("scene_file", "supervision"), ("supervision", "recording"),
    },
    "web_panel": {
        ("accuracy_results", "views"), ("page", "controls"), ("page", "views"), ("rig", "tuning"), ("tuning", "page"),
    },
}  # fmt: skip


def statements(node: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """Imports that run, also those inside functions; what only the type checker reads is none."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child
        elif isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
            yield from statements(ast.Module(child.orelse, []))
        else:
            yield from statements(child)


def imported(tree: ast.Module, modules: Mapping[str, Path]) -> set[str]:
    """The modules, among these, that a module imports."""
    named: set[str] = set()
    for statement in statements(tree):
        if isinstance(statement, ast.Import):
            named.update(each.name for each in statement.names)
        else:
            inside = statement.module or ""
            parts = [f"{inside}.{each.name}" for each in statement.names]
            named.update(part if part in modules else inside for part in parts)
    return named & modules.keys()


def modules_in(*tops: Path) -> dict[str, Path]:
    """Every module below these folders by its full name."""
    found: dict[str, Path] = {}
    for top in tops:
        for path in top.rglob("*.py"):
            *folders, last = path.relative_to(top).with_suffix("").parts
            found[".".join(folders if last == "__init__" else (*folders, last))] = path
    return found


def folders_of(modules: Mapping[str, Path]) -> dict[str, Pairs]:
    """Imports among the children of each folder: folder -> child -> the others that it imports."""
    found: dict[str, Pairs] = defaultdict(set)
    for name, path in modules.items():
        own = name.split(".")
        for other in imported(ast.parse(path.read_text(encoding="utf-8")), modules):
            there = other.split(".")
            shared = next((n for n, (a, b) in enumerate(zip(own, there, strict=False)) if a != b), 0)
            if shared:
                found[".".join(own[:shared])].add((own[shared], there[shared]))
    return found


def circle_in(pairs: Pairs) -> list[str]:
    """A circle of children, each of which imports the one before it; empty where there is none."""
    order: graphlib.TopologicalSorter[str] = graphlib.TopologicalSorter()
    for importer, other in pairs:
        order.add(importer, other)
    try:
        order.prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def test_no_circle_but_those_that_are_known() -> None:
    folders = folders_of(modules_in(ROOT / "shared", ROOT / "services"))
    circles = {name: circle_in(pairs - BACK.get(name, set())) for name, pairs in folders.items()}
    assert {name: circle for name, circle in circles.items() if circle} == {}
    gone = {name: back - folders[name] for name, back in BACK.items()}
    assert {name: pairs for name, pairs in gone.items() if pairs} == {}
    needless = {
        (name, pair)
        for name, back in BACK.items()
        for pair in back
        if not circle_in(folders[name] - (back - {pair}))
    }
    assert needless == set(), "these close no circle"


def test_a_circle_is_found_wherever_its_imports_stand(tmp_path: Path) -> None:
    def written(folder: str, text: str) -> None:
        (tmp_path / "top" / folder).mkdir(parents=True, exist_ok=True)
        (tmp_path / "top" / folder / "__init__.py").touch()
        (tmp_path / "top" / folder / "module.py").write_text(text, encoding="utf-8")

    (tmp_path / "top").mkdir()
    (tmp_path / "top" / "__init__.py").touch()
    written("a", "from top import b\n")
    written("b", "def late():\n    import top.c.module\n")
    written("c", "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from top.a import module\n")
    assert folders_of(modules_in(tmp_path)) == {"top": {("a", "b"), ("b", "c")}}
    assert circle_in({("a", "b"), ("b", "c")}) == []
    written("c", "class Late:\n    from top.a import module\n")
    assert set(circle_in(folders_of(modules_in(tmp_path))["top"])) == {"a", "b", "c"}
