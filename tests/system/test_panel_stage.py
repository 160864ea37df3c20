"""The stage page in a real browser, against a fake haptic side: it moves while the rig plays, and only listens."""

from collections.abc import Iterator

import pytest
from browser import DESKTOP, PATIENCE_MS, PHONE, visitor
from fake_rig import FakeRig
from panel_process import PanelProcess
from playwright.sync_api import Browser, Page, expect

from web_panel.stage.stage_page import CUT_OFF

SMALL = (600, 340)  # drawn without a graphics card
pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]
# What the canvas shows, of a picture that was just drawn: later its memory is given away. So many pictures that differ
# from the one before, in all, and so many that are alike, one after the other.
_PICTURES = """async (wanted) => {
  const canvas = document.querySelector("canvas");
  const picture = () => new Promise(found => requestAnimationFrame(() => found(canvas.toDataURL())));
  let before = await picture(), differ = 0, alike = 0;
  while (wanted === "differ" ? differ < 5 : alike < 5) {
    const now = await picture();
    if (now === before) alike += 1;
    else [differ, alike] = [differ + 1, 0];
    before = now;
  }
  return true;
}"""


@pytest.fixture
def rig(faked: FakeRig) -> FakeRig:
    faked.begin_again()
    return faked


@pytest.fixture
def strangers() -> list[str]:
    return []


@pytest.fixture
def stage_page(browser: Browser, rig: FakeRig, served: PanelProcess, strangers: list[str]) -> Iterator[Page]:
    context = visitor(browser, SMALL, strangers)
    try:
        page = context.new_page()
        faults: list[str] = []
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("console", lambda said: faults.append(said.text) if "Content Security" in said.text else None)
        page.goto(served.stage)
        expect(page.locator("body[data-mood=busy]")).to_be_attached()
        yield page
        assert faults == []
        assert strangers == []
    finally:
        context.close()


def words(page: Page, text: str) -> None:
    expect(page.locator("#words")).to_have_text(text, timeout=PATIENCE_MS)


def test_the_stick_moves_while_it_plays_and_stands_when_nothing_comes(stage_page: Page, rig: FakeRig) -> None:
    words(stage_page, "")
    assert stage_page.evaluate(_PICTURES, "differ")
    rig.mute(True)
    expect(stage_page.locator("#words")).to_contain_text("No data from the haptic server")
    assert stage_page.evaluate(_PICTURES, "alike")
    rig.mute(False)
    words(stage_page, "")
    assert stage_page.evaluate(_PICTURES, "differ")


def test_it_says_the_pages_words_in_fault_and_where_nothing_plays(stage_page: Page, rig: FakeRig) -> None:
    for status, said in (
        ("fault: the <b>arm</b> was unplugged", "Fault: the <b>arm</b> was unplugged"),
        ("panic", "Panic: zero force"),
        ("ready", "Ready"),
        ("playing", ""),
    ):
        rig.status = status
        words(stage_page, said)


def test_the_address_tells_no_token_and_the_page_has_no_controls(stage_page: Page) -> None:
    assert stage_page.evaluate("() => location.pathname + location.search") == "/stage"
    assert stage_page.locator("button, input, a, [tabindex]").count() == 0


@pytest.mark.long
def test_the_picture_fills_the_screen(stage_page: Page) -> None:
    for width, height in (DESKTOP, PHONE):
        stage_page.set_viewport_size({"width": width, "height": height})
        box = stage_page.locator("canvas").bounding_box()
        assert box == {"x": 0, "y": 0, "width": width, "height": height}
        stage_page.wait_for_function(
            "([w, h]) => { const c = document.querySelector('canvas'); return c.width === w && c.height === h; }",
            arg=[width, height],
        )


@pytest.mark.long
def test_it_says_that_the_panel_is_away(browser: Browser, own_rig: FakeRig, own_panel: PanelProcess) -> None:
    context = visitor(browser, SMALL)
    try:
        page = context.new_page()
        page.goto(own_panel.stage)
        expect(page.locator("body[data-mood=busy]")).to_be_attached()
        own_panel.stop()
        words(page, CUT_OFF)
    finally:
        context.close()
