"""docs/python.md: every piece of code runs, in its order, and prints what stands below it."""

import contextlib
import io
import re
from pathlib import Path

import pytest

import drumstick as ds

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
PIECES = re.findall(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```)?", PAGE, re.DOTALL)


def test_every_piece_runs_and_prints_what_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    assert len(PIECES) == PAGE.count("```python") > 5
    for code, printed in PIECES:
        heard = io.StringIO()
        with contextlib.redirect_stdout(heard):
            exec(compile(code, "docs/python.md", "exec"), names)
        assert heard.getvalue() == printed, code


def test_every_name_is_on_the_page() -> None:
    table = PAGE[PAGE.index("## All names") : PAGE.index("## What will stay")]
    assert {*re.findall(r"`(\w+)`", table)} - {"ValueError"} == {*ds.__all__}
