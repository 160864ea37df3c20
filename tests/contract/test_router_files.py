"""deploy/zenoh holds what the table of roles says."""

from drumstick_lab.pages import zenoh_routers as tool


def test_the_router_files_are_up_to_date() -> None:
    there = {path.name: path.read_text(encoding="utf-8") for path in tool.FOLDER.glob("*.json5")}
    assert there == tool.files(), "run: .venv/bin/drumstick lab zenoh-routers"
