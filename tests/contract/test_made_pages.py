"""The made pages under docs/ say what the code and the stored results say."""

import importlib.util
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "docs" / "tools"


@pytest.mark.parametrize("name", ["zenoh_page", "measured_page", "scenes_page"])
def test_the_page_is_up_to_date(name: str) -> None:
    spec = importlib.util.spec_from_file_location(name, TOOLS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    made = tool.page()
    assert tool.PAGE.read_text(encoding="utf-8") == made, f"run: .venv/bin/python docs/tools/{name}.py"
