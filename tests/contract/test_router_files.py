"""deploy/zenoh holds what the table of roles says."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_router_files_are_up_to_date() -> None:
    spec = importlib.util.spec_from_file_location(
        "zenoh_routers", ROOT / "docs" / "tools" / "zenoh_routers.py"
    )
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    there = {path.name: path.read_text(encoding="utf-8") for path in tool.FOLDER.glob("*.json5")}
    assert there == tool.files(), "run: .venv/bin/python docs/tools/zenoh_routers.py"
