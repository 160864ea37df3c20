"""Violations that axe finds on the page: drumstick lab accessibility.

At a desk, on a tablet and on a phone, with all folders open, as the tests do it (tests/system/test_panel_accessible.py):
a panel beside a stand-in for the rig. Stored: by size, what axe found wrong, what it could not decide, and how many of
its rules the page passed.
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

from axe_playwright_python.sync_playwright import Axe
from browser import DESKTOP, PHONE, chromium, opened, readback, visitor
from fake_rig import FakeRig
from panel_process import panel
from playwright.sync_api import Browser, expect

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.measuring import stored
from ports import free_port

SIZES = {"desktop": DESKTOP, "tablet": (820, 1180), "phone": PHONE}
FOLDERS = ("Presets", "Lock tuning", "Scene", "More")
PATIENCE_MS = 600_000.0
expect.set_options(timeout=PATIENCE_MS)


def looked_at(browser: Browser, address: str, size: tuple[int, int]) -> dict[str, Any]:
    """Findings of axe on the page at one size."""
    context = visitor(browser, size)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    expect(readback(page, "dv_pls")).to_have_text("0.2m/s")
    for folder in FOLDERS:
        opened(page, folder)
    page.get_by_role("button", name="Set", exact=True).hover()  # waits for the folders to have unfolded
    expect(page.get_by_role("slider", name="Level of the roll")).to_be_visible()
    said = Axe().run(page).response
    context.close()
    return {
        "axe": said["testEngine"]["version"],
        "violations": [[each["id"], len(each["nodes"])] for each in said["violations"]],
        "undecided": [[each["id"], len(each["nodes"])] for each in said["incomplete"]],
        "rules_passed": len(said["passes"]),
    }


def main() -> None:
    """Look, tell and store."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    rows = dict[str, Any]()
    rig = FakeRig(parse(shipped_text("roll"), "roll.toml"))
    try:
        with (
            tempfile.TemporaryDirectory() as folder,
            panel(rig.endpoint, free_port(), Path(folder) / "token") as served,
            chromium() as browser,
        ):
            for name, size in SIZES.items():
                rows[name] = looked_at(browser, served.address, size)
                print(name, rows[name], flush=True)
    finally:
        rig.close()
    stored.store("accessibility", {"rows": rows})


if __name__ == "__main__":
    main()
