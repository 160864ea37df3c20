"""Pages whose tables name tests: each of those exists, and what is called long is, or has a case that is."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
HEADS = ("| ---", "| who |", "| promise |")
NAMED = re.compile(r"`([\w/]+\.py)(?:::(\w+))?`( \(long\))?")


def is_long(text: str, name: str) -> bool:
    above = re.search(rf"((?:^@.*\n(?:^[ )\]].*\n)*)*)^def {name}\(", text, re.MULTILINE)
    assert above is not None, name
    marks = above[1] + "".join(re.findall(r"^pytestmark = .*$", text, re.MULTILINE))
    return "mark.long" in marks or "mark.daily" in marks


@pytest.mark.parametrize("page", ["promises", "threats"])
def test_every_row_names_a_test_that_exists(page: str) -> None:
    text = (TESTS.parent / "docs" / f"{page}.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| ") and not line.startswith(HEADS)]
    assert len(rows) > 10
    for row in rows:
        named = NAMED.findall(row)
        assert named, row
        for path, name, long in named:
            source = (TESTS / path).read_text(encoding="utf-8")
            if name:
                assert f"def {name}(" in source, row
                assert not long or is_long(source, name), row
