"""Words of the page when its own connection to the panel is gone, in a real browser."""

import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from browser import NARROW, PATIENCE_MS, part, readback, visitor
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess, panel
from playwright.sync_api import Browser, Page, expect

from drumstick.scenes.scene_text import parse, shipped_text

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]
WORDS = (
    "No connection to the panel: what you see is old, and PANIC is not heard. Use the switch at the device."
)


@pytest.fixture
def rig() -> Iterator[FakeRig]:
    made = FakeRig(parse(shipped_text("roll"), "roll.toml"))
    yield made
    made.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = visitor(browser, NARROW)
    opened = context.new_page()
    yield opened
    context.close()


def visit(page: Page, served: PanelProcess) -> None:
    page.goto(served.address)
    expect(readback(page, "dv_pls")).to_have_text("0.2m/s", timeout=PATIENCE_MS)
    expect(part(page, "cut-off")).to_have_count(0, timeout=PATIENCE_MS)


@pytest.mark.long
def test_a_panel_that_hangs_is_told_until_it_goes_on(
    page: Page, rig: FakeRig, tmp_path: Path, free_port: Callable[[], int]
) -> None:
    with panel(rig.endpoint, free_port(), tmp_path / "token") as served:
        visit(page, served)
        served.process.send_signal(signal.SIGSTOP)
        try:
            expect(part(page, "cut-off")).to_contain_text(WORDS, timeout=PATIENCE_MS)
            expect(part(page, "cut-off")).to_be_in_viewport()
            expect(part(page, "spoken")).to_contain_text(WORDS)
        finally:
            served.process.send_signal(signal.SIGCONT)
        expect(part(page, "cut-off")).to_have_count(0, timeout=PATIENCE_MS)


# Looks of the page's script, each of which asks for the panel's beat, from the first at which PANIC takes no clicks to
# the first at which the page says so.
DEAF_LOOKS = """() => {
  const find = document.querySelector.bind(document);
  const button = find("div:has(> .dr-panic) + div button");
  let looks = 0;
  window.deafLooks = null;
  document.querySelector = (selector) => {
    if (selector === "[data-beat]") {
      if (!button.isConnected || getComputedStyle(button).pointerEvents === "none") looks += 1;
      setTimeout(() => { if (find("[data-part=cut-off]")) window.deafLooks ??= looks; });
    }
    return find(selector);
  };
}"""


def test_a_panic_that_takes_no_clicks_says_so_at_once(
    page: Page, rig: FakeRig, tmp_path: Path, free_port: Callable[[], int]
) -> None:
    with panel(rig.endpoint, free_port(), tmp_path / "token") as first:
        visit(page, first)
        page.evaluate(DEAF_LOOKS)
        first.process.kill()
        first.process.wait()
    expect(part(page, "cut-off")).to_contain_text(WORDS, timeout=PATIENCE_MS)
    page.wait_for_function("window.deafLooks !== null")
    assert page.evaluate("window.deafLooks") <= 2


@pytest.mark.long
def test_a_panel_that_ended_is_told_in_full_colour_until_another_one_is_there(
    page: Page, rig: FakeRig, tmp_path: Path, free_port: Callable[[], int]
) -> None:
    port = free_port()
    with panel(rig.endpoint, port, tmp_path / "token") as first:
        visit(page, first)
        first.process.kill()
        first.process.wait()
    strip = part(page, "cut-off")
    expect(strip).to_contain_text(WORDS, timeout=PATIENCE_MS)
    # viser dims its controls; nothing that the strip is inside of may be dimmed.
    faint = strip.evaluate(
        "part => { let least = 1; for (let at = part; at; at = at.parentElement)"
        " least = Math.min(least, Number(getComputedStyle(at).opacity)); return least; }"
    )
    assert faint == 1.0
    box = strip.bounding_box()
    assert box is not None
    assert (box["x"], box["y"], box["width"]) == (0.0, 0.0, NARROW[0])
    with panel(rig.endpoint, port, tmp_path / "token"):
        page.bring_to_front()  # viser connects again only while the window has the focus
        # A browser makes a page wait, longer each time, after connections that failed.
        expect(strip).to_have_count(0, timeout=PATIENCE_MS)
        assert rig.panics == 0
        page.keyboard.press("Escape")
        wait_until(lambda: rig.panics, "a panic by the page that was cut off")
