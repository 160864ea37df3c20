"""Store docs/images/panel.png: `python docs/tools/panel_screenshot.py 'http://127.0.0.1:8080/?token=...'`.

The panel, with a rig that plays, must be running. Needs Playwright's Python package and Debian's Chromium.
"""

import argparse
import os
import sys
from pathlib import Path
from shutil import which

from playwright.sync_api import sync_playwright

IMAGE = Path(__file__).resolve().parents[1] / "images" / "panel.png"
SOFTWARE_WEBGL = ["--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
QUIET = ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run"]
TRACE_FILLS_MS = 11_000


def store(address: str, image: Path, program: str) -> None:
    """Visit the page, wait until a readback is shown and ten seconds have been traced, and store what is seen."""
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program, headless=True, args=[*SOFTWARE_WEBGL, *QUIET, *sandbox]
        )
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(address)
        page.locator('[data-param="k_coll"] [data-part="readback"]').wait_for()
        page.wait_for_timeout(TRACE_FILLS_MS)
        image.parent.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=image)
        browser.close()


def main() -> int:
    """Exit status 0 stored, 3 no Chromium."""
    parser = argparse.ArgumentParser(description="Store a picture of a running panel.")
    parser.add_argument("address", help="as the panel printed it")
    parser.add_argument("--out", type=Path, default=IMAGE)
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
