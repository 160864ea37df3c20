"""Violations that axe finds on the page: drumstick lab accessibility.

At a desk, on a wide window, on a tablet and on a phone, with all folders open, as the tests do it
(tests/system/test_panel_accessible.py): a panel beside a stand-in for the rig; and on the page for a second screen,
while it plays and in panic. Stored: for each, what axe found wrong, what it could not decide, and how many of its rules
the page passed.
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

from axe_findings import AxeFindings, axe_findings
from browser import DESKTOP, PHONE, chromium, opened, readback, visitor
from fake_rig import FakeRig
from panel_process import panel
from playwright.sync_api import Browser, expect

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.measuring import stored
from ports import free_port

SIZES = {"desktop": DESKTOP, "wide window": (2560, 1440), "tablet": (820, 1180), "phone": PHONE}
FOLDERS = ("Presets", "Lock tuning", "Scene", "More")
PATIENCE_MS = 600_000.0
expect.set_options(timeout=PATIENCE_MS)


def looked_at(browser: Browser, address: str, size: tuple[int, int]) -> AxeFindings:
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
    found = axe_findings(page)
    context.close()
    return found


def on_stage(browser: Browser, address: str, mood: str) -> AxeFindings:
    """Findings of axe on the page for a second screen, when it is in this mood."""
    context = visitor(browser, (1920, 1080))
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    page.locator(f"body[data-mood={mood}]").wait_for()
    found = axe_findings(page)
    context.close()
    return found


def row_of(found: AxeFindings) -> dict[str, Any]:
    """Stored form: of each rule, how many nodes."""
    return {
        "axe": found.version,
        "violations": _counted(found.violations),
        "undecided": _counted(found.undecided),
        "rules_passed": found.rules_passed,
    }


def _counted(nodes: list[tuple[str, str]]) -> list[list[Any]]:
    rules = [rule for rule, _ in nodes]
    return [[rule, rules.count(rule)] for rule in dict.fromkeys(rules)]


def main() -> None:
    """Look, tell and store."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    found = dict[str, AxeFindings]()
    rig = FakeRig(parse(shipped_text("roll"), "roll.toml"))
    try:
        with (
            tempfile.TemporaryDirectory() as folder,
            panel(rig.endpoint, free_port(), Path(folder) / "token") as served,
            chromium() as browser,
        ):
            for name, size in SIZES.items():
                found[name] = looked_at(browser, served.address, size)
            found["second screen, playing"] = on_stage(browser, served.stage, "busy")
            rig.status = "panic"
            found["second screen, in panic"] = on_stage(browser, served.stage, "bad")
    finally:
        rig.close()
    for name, each in found.items():
        print(name, *each, flush=True)
    stored.store("accessibility", {"rows": {name: row_of(each) for name, each in found.items()}})


if __name__ == "__main__":
    main()
