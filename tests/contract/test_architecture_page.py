"""The architecture page: every path and function that it names is there, and it names every room of the house."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
TESTS = ROOT / "tests"
PAGE = (DOCS / "architecture.md").read_text(encoding="utf-8")
GLOSSARY = (DOCS / "glossary.md").read_text(encoding="utf-8")
_PATH = re.compile(r"`((?:shared|services|lab|tests|docs|deploy)(?:/[\w.-]+)*|pyproject\.toml)`")
_FUNCTION = re.compile(r"`((?:shared|services)/[\w/]+\.py)` \(`(\w+)`\)")


def functions(path: Path) -> set[str]:
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return {
        node.name for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, kinds)
    }


@pytest.mark.parametrize("text", [PAGE, GLOSSARY], ids=["architecture", "glossary"])
def test_every_path_exists(text: str) -> None:
    named = _PATH.findall(text)
    assert len(named) > 15
    assert not [path for path in named if not (ROOT / path).exists()]


def test_every_function_exists_in_its_module() -> None:
    named = _FUNCTION.findall(PAGE)
    assert len(named) > 12
    assert not [(path, name) for path, name in named if name not in functions(ROOT / path)]


@pytest.mark.parametrize(
    "title", ["A strike, from the tick to the speaker", "A value, from the slider to the force"]
)
def test_a_way_has_as_many_modules_as_it_says(title: str) -> None:
    way = PAGE.partition(f"## {title}\n")[2].partition("\n## ")[0]
    folder, named = ROOT, set[Path]()
    for word in re.findall(r"`([\w/]+\.py)`", way):
        folder = (ROOT / word).parent if "/" in word else folder
        named.add(folder / Path(word).name)
    assert not [path for path in named if not path.is_file()]
    assert re.findall(r"^(\d+) modules", way, re.MULTILINE) == [str(len(named))]


def test_what_goes_red_is_a_test() -> None:
    rows = [
        line.split(" | ")
        for line in PAGE[PAGE.index("## I want") :].splitlines()[4:]
        if line.startswith("| ")
    ]
    assert len(rows) > 20
    for row in rows:
        named = re.findall(r"`([^`]+)`", row[-1])
        assert named, row
        for path in (ROOT / name for name in named):
            assert path.is_relative_to(TESTS), path
            assert path.name.startswith("test_") if path.is_file() else any(path.rglob("test_*.py")), path


def test_every_room_is_on_the_page() -> None:
    rooms = {
        path.parent.relative_to(ROOT)
        for part in ("shared", "services")
        for path in (ROOT / part).rglob("*.py")
        if path.name != "__init__.py"
    }
    folders = PAGE[PAGE.index("## Folders") : PAGE.index("## I want")]
    named = set(re.findall(r"`([\w/]+)`", folders))
    assert not [
        room for room in sorted(rooms) if not {str(room), room.name, "/".join(room.parts[-2:])} & named
    ]


def test_no_folder_holds_more_modules_than_can_be_taken_in() -> None:
    for part in ("shared", "services", "lab"):
        for folder in (ROOT / part).rglob("*"):
            modules = [path for path in folder.glob("*.py") if path.name != "__init__.py"]
            assert len(modules) <= 14, folder


def test_the_index_of_decisions_names_each_of_them() -> None:
    index = (DOCS / "decisions" / "README.md").read_text(encoding="utf-8")
    for path in (DOCS / "decisions").glob("*.md"):
        if path.name != "README.md":
            title = path.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")
            number, _, words = title.partition(" ")
            assert f"| {number} | [{words}]({path.name}) |" in index


def test_the_glossary_is_in_order() -> None:
    words = [
        line.split(" | ")[0].removeprefix("| ").lower()
        for line in GLOSSARY.splitlines()[4:]
        if line.startswith("| ")
    ]
    assert len(words) > 50
    assert words == sorted(words)
