"""Chromium for tests and screenshots: Debian's, headless, with software WebGL, and no way out of this machine."""

import os
import re
import time
from collections.abc import Generator
from contextlib import contextmanager
from shutil import which

from playwright.sync_api import Browser, BrowserContext, Locator, Page, Route, expect, sync_playwright
from rig_process import PATIENCE_S

FLAGS = [
    "--disable-gpu",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
# Software WebGL beside other tests: what a person sees in a second has taken half a minute. Whoever waits, waits for an
# event; this is only when to give up.
PATIENCE_MS = 1000.0 * PATIENCE_S
expect.set_options(timeout=PATIENCE_MS)  # its own is 5 s, whatever the page's is
DESKTOP = (1280, 800)
PHONE = (390, 844)
# A style that puts the picture out of view at every size, for whoever looks at boxes: drawn by software it takes most
# of a second for each frame.
NO_PICTURE = (
    "div:has(> div > div > canvas[data-engine])"
    "{transform: translateX(-200vw); width: 1px !important; height: 1px !important}"
)
NARROW = (560, 900)  # laid out as on a phone, without the picture: software WebGL makes every click slow
ROOMS = (("phone", 577), ("tablet", 801), ("desk", 1500))  # for windows narrower than so many dots


@contextmanager
def chromium() -> Generator[Browser]:
    """A running browser; RuntimeError when none is installed."""
    program = which("chromium")
    if program is None:
        raise RuntimeError("chromium is not installed")
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program, headless=True, args=[*FLAGS, *sandbox], timeout=PATIENCE_MS
        )
        try:
            yield browser
        finally:
            browser.close()


def visitor(
    browser: Browser,
    size: tuple[int, int] = DESKTOP,
    strangers: list[str] | None = None,
    home: str | None = None,
) -> BrowserContext:
    """A fresh profile. Requests for other machines fail and are noted in `strangers`. `home`: a page over TLS whose
    certificate its visitor trusts.
    """
    phone = size[0] < 600
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]},
        device_scale_factor=2 if phone else 1,
        is_mobile=phone,
        has_touch=phone,
        ignore_https_errors=home is not None,
    )
    homes = ("http://127.0.0.1:", "http://localhost:", "data:", "blob:", *([home] if home else []))

    def at_home(route: Route) -> None:
        url = route.request.url
        if url.startswith(homes):
            route.continue_()
            return
        if strangers is not None:
            strangers.append(url)
        route.abort()

    context.set_default_timeout(PATIENCE_MS)
    context.route("**/*", at_home)
    return context


def _tell_of(page: Page) -> None:
    # Printed, so that pytest shows it beside a failure: why a page stands still is seen nowhere else.
    def when() -> str:
        return f"page, {time.monotonic():.1f} s:"

    page.on("crash", lambda _: print(when(), "crashed"))
    page.on("pageerror", lambda error: print(when(), error))
    page.on("console", lambda said: print(when(), said.text) if said.type == "error" else None)
    page.on("websocket", lambda socket: socket.on("close", lambda _: print(when(), "a websocket closed")))


@contextmanager
def page_at(
    browser: Browser,
    address: str,
    patience_ms: float,
    strangers: list[str] | None = None,
    size: tuple[int, int] = NARROW,
) -> Generator[Page]:
    """A fresh profile's page, when it shows the roll as its scene has it."""
    context = visitor(browser, size, strangers)
    try:
        page = context.new_page()
        page.set_default_timeout(patience_ms)
        _tell_of(page)
        page.goto(address)
        expect(readback(page, "dv_pls")).to_have_text("0.2m/s", timeout=patience_ms)
        yield page
    finally:
        context.close()


def control(page: Page, name: str) -> Locator:
    """The words and the readback of one parameter, by its wire name."""
    return page.locator(f'[data-param="{name}"]')


def readback(page: Page, name: str) -> Locator:
    """The readback of one parameter: number and unit."""
    return control(page, name).locator('[data-part="readback"]')


def note(page: Page, name: str) -> Locator:
    """Words in place about one parameter: a refusal, or that it waits."""
    return control(page, name).locator('[data-part="note"]')


def slider(page: Page, name: str) -> Locator:
    """The thumb of one parameter's slider; it takes arrow keys."""
    return page.locator(f'xpath=//*[@data-param="{name}"]/following::*[@role="slider"][1]')


def grasp(page: Page, name: str) -> tuple[float, float]:
    """Press the mouse on the thumb of a slider; where, in pixels.

    What comes above the slider late moves it away between the look and the press, so it is seen that the thumb is held.
    """
    thumb = slider(page, name)
    for _ in range(10):
        thumb.hover()  # waits until it stands still
        box = thumb.bounding_box()
        assert box is not None, f"{name} has no slider that is shown"
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        if thumb.get_attribute("data-dragging") is not None:
            return x, y
        page.mouse.up()
        print(f"the slider of {name} was not where it had stood")
        page.wait_for_timeout(500)
    raise AssertionError(f"the slider of {name} was not grasped in ten tries")


def part(page: Page, name: str) -> Locator:
    """A named part of the page: notice, roll-rate, v-e, strike, servo, sound, panic, exact, absent."""
    return page.locator(f'[data-part="{name}"]')


def see(page: Page, name: str, text: str | re.Pattern[str]) -> None:
    """Wait until a named part has this text in it."""
    expect(part(page, name)).to_contain_text(text, timeout=PATIENCE_MS)


def resize(page: Page, size: tuple[int, int]) -> None:
    """Give the window another size, and wait until the panel has shown what there is room for."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    room = next((name for name, below in ROOMS if size[0] < below), "wide")
    expect(page.locator("[data-room]")).to_have_attribute("data-room", room)


def opened(page: Page, folder: str) -> None:
    """Open a folder of the page, unless it is open: a test may have opened it, or its own first run."""
    head = page.get_by_role("button", name=folder, exact=True)
    expect(head).to_have_attribute("aria-expanded", re.compile("true|false"))
    if head.get_attribute("aria-expanded") == "false":
        head.click()
    expect(head).to_have_attribute("aria-expanded", "true")
