"""Pictures of the panel, docs/images/panel.png, panel-wide.png, panel-phone.png and stage.png: drumstick lab panel-screenshot ADDRESS.

ADDRESS is what the panel printed first, in quotes; a rig must be playing. Needs Playwright's Python package and Debian's Chromium.
"""

import argparse
import os
import sys
from pathlib import Path
from shutil import which

from playwright.sync_api import Browser, Page, sync_playwright

from drumstick_lab.checkout import DOCS

IMAGES = DOCS / "images"
SOFTWARE_WEBGL = ["--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
QUIET = ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run"]
TRACE_FILLS_MS = 11_000
SCROLLED_MS = 1_000
COMPUTED_MS = 180_000  # the first prediction on a machine compiles


def _visit(browser: Browser, address: str, width: int, height: int, phone: bool) -> Page:
    page = browser.new_page(
        viewport={"width": width, "height": height},
        device_scale_factor=2 if phone else 1,
        is_mobile=phone,
        has_touch=phone,
    )
    page.set_default_timeout(COMPUTED_MS)
    page.goto(address)
    page.locator('[data-param="k_coll"] [data-part="readback"]').wait_for()
    return page


def store(address: str, images: Path, program: str) -> None:
    """Visit the page, wait until a readback is shown and ten seconds have been traced, and store what is seen."""
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
    images.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program, headless=True, args=[*SOFTWARE_WEBGL, *QUIET, *sandbox]
        )
        desktop = _visit(browser, address, 1280, 900, phone=False)
        for words in ("Predicted:", "Filled: within reach"):
            desktop.get_by_text(words).wait_for(timeout=COMPUTED_MS)
        desktop.wait_for_timeout(TRACE_FILLS_MS)
        desktop.screenshot(path=images / "panel.png")
        desktop.set_viewport_size({"width": 1920, "height": 1080})
        desktop.locator("[data-room=wide]").wait_for(state="attached")
        desktop.get_by_role("button", name="Orbit", exact=True).click()
        desktop.locator('[data-part="view"]').get_by_text("Orbit").wait_for()
        desktop.wait_for_timeout(TRACE_FILLS_MS)
        desktop.screenshot(path=images / "panel-wide.png")
        desktop.close()
        stage = browser.new_page(viewport={"width": 1280, "height": 720})
        stage.goto(address.replace("/?", "/stage?"))
        stage.locator("body[data-mood=busy]").wait_for()
        stage.wait_for_timeout(SCROLLED_MS)
        stage.screenshot(path=images / "stage.png")
        stage.close()
        phone = _visit(browser, address, 390, 844, phone=True)
        phone.get_by_role("button", name="Orbit", exact=True).click()
        phone.locator('[data-part="view"]').get_by_text("Orbit").wait_for()
        phone.mouse.move(0, 0)
        phone.wait_for_timeout(TRACE_FILLS_MS)  # until theory has come, too
        phone.locator(".uplot").last.scroll_into_view_if_needed()
        phone.wait_for_timeout(SCROLLED_MS)
        phone.screenshot(path=images / "panel-phone.png")
        browser.close()


def main() -> int:
    """Exit status 0 stored, 3 no Chromium."""
    parser = argparse.ArgumentParser(description="Store a picture of a running panel.")
    parser.add_argument("address", help="as the panel printed it")
    parser.add_argument("--out", type=Path, default=IMAGES, help="a folder")
    given = parser.parse_args()
    program = which("chromium")
    if program is None:
        print("chromium is not installed", file=sys.stderr)
        return 3
    store(given.address, given.out, program)
    print(given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
