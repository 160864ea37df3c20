"""The bibliography: each place that it names cites the source, and each title that is quoted with a year is in it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "bibliography.md").read_text(encoding="utf-8")
ROWS = [line.strip("| ").split(" | ") for line in PAGE.splitlines() if line.startswith("| ")][1:]
# A quoted title, and a year soon after it.
TITLE = re.compile(r'"([A-Z][^"`{}=\\]{14,120})"(?:,? \(|, )(?:[A-Z][^"`={}]{0,55})?\b(?:1[89]|20)\d\d\b')


def plain(text: str) -> str:
    return re.sub(r"[\s#]+", " ", text)


def texts() -> dict[str, str]:
    folders = (ROOT / name for name in ("docs", "shared", "services", "lab"))
    found = [path for folder in folders for path in [*folder.rglob("*.py"), *folder.rglob("*.md")]]
    return {str(path.relative_to(ROOT)): plain(path.read_text(encoding="utf-8")) for path in found}


TEXTS = texts()


@pytest.mark.parametrize(("source", "places"), ROWS, ids=[row[0][:24] for row in ROWS])
def test_each_place_names_the_first_author(source: str, places: str) -> None:
    author = re.split(r"[, ]", source)[0]
    paths = re.findall(r"`([^`]+)`", places)
    assert paths
    assert not [path for path in paths if author not in TEXTS.get(path, "")]


def test_each_quoted_title_is_in_it() -> None:
    cited = {path: text for path, text in TEXTS.items() if path != "docs/bibliography.md"}
    titles = {title: path for path, text in cited.items() for title in TITLE.findall(text)}
    assert len(titles) > 12
    assert not {title: path for title, path in titles.items() if plain(title) not in plain(PAGE)}
