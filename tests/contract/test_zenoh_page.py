"""docs/zenoh.md says what the code does: it is made from it."""

import importlib.util
from pathlib import Path

TOOL = Path(__file__).parents[2] / "docs" / "tools" / "zenoh_page.py"


def test_the_page_is_what_the_code_says() -> None:
    spec = importlib.util.spec_from_file_location("zenoh_page", TOOL)
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    made = tool.page()
    assert tool.PAGE.read_text(encoding="utf-8") == made, "run: .venv/bin/python docs/tools/zenoh_page.py"
