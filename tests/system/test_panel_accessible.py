"""The page for fingers and screen readers: at a desk, on a tablet and on a phone, with all its folders open."""

import re
from collections.abc import Iterator

import pytest
from axe_findings import axe_findings
from browser import DESKTOP, PATIENCE_MS, PHONE, opened, readback, slider, visitor
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess
from playwright.sync_api import Browser, Page, expect

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]
TABLET, WIDE = (820, 1180), (2560, 1440)
FOLDERS = ("Presets", "Lock tuning", "Scene", "More")
# What a finger meets 22 px to each side of the middle of everything that can be pressed: 44 px across.
TOO_SMALL = """() => {
  const small = [], AWAY = 21.5;
  for (const part of document.querySelectorAll("button, [role=button], [role=slider], input, a[href]")) {
    if (part.tabIndex < 0 || part.disabled || !part.checkVisibility()) continue;
    part.scrollIntoView({block: "center", inline: "center"});
    const box = part.getBoundingClientRect();
    const x = box.left + box.width / 2, y = box.top + box.height / 2;
    for (const [dx, dy] of [[0, 0], [-AWAY, 0], [AWAY, 0], [0, -AWAY], [0, AWAY]]) {
      const met = document.elementFromPoint(x + dx, y + dy);
      if (!part.contains(met)) small.push([part.ariaLabel || part.textContent, dx, dy, met && met.className]);
    }
  }
  return small;
}"""


@pytest.fixture(
    scope="module", params=[DESKTOP, WIDE, TABLET, PHONE], ids=["desktop", "wide", "tablet", "phone"]
)
def page(
    request: pytest.FixtureRequest, browser: Browser, faked: FakeRig, served: PanelProcess
) -> Iterator[Page]:
    faked.begin_again()
    context = visitor(browser, request.param)
    try:
        shown = context.new_page()
        shown.goto(served.address)
        expect(readback(shown, "dv_pls")).to_have_text("0.2m/s")
        for folder in FOLDERS:
            opened(shown, folder)
        shown.get_by_role("button", name="Set", exact=True).hover()  # waits for the folders to have unfolded
        expect(shown.get_by_role("slider", name="Level of the roll")).to_be_visible()
        yield shown
    finally:
        context.close()


@pytest.mark.long
@pytest.mark.daily("*phone*")
def test_axe_finds_nothing(page: Page) -> None:
    found = axe_findings(page)
    assert found.violations == []
    assert found.undecided == []


def test_axe_finds_nothing_on_the_page_for_a_second_screen(
    browser: Browser, faked: FakeRig, served: PanelProcess
) -> None:
    faked.begin_again()
    context = visitor(browser, DESKTOP)
    try:
        shown = context.new_page()
        shown.goto(served.stage)
        for status, mood in (("playing", "busy"), ("panic", "bad")):
            faked.status = status
            shown.locator(f"body[data-mood={mood}]").wait_for(timeout=PATIENCE_MS)
            found = axe_findings(shown)
            assert (found.violations, found.undecided) == ([], [])
    finally:
        context.close()
        faked.begin_again()


@pytest.mark.long
@pytest.mark.daily("*phone*")
def test_a_screen_reader_finds_its_way(page: Page) -> None:
    expect(page.get_by_role("main")).to_have_count(1)
    assert page.get_by_role("heading", level=1).all_text_contents() == ["Drumstick: main"]
    assert page.get_by_role("heading", level=2).all_text_contents() == [
        "Playing and tuning", "Striking the drum", "Presets, lock and scenes", "State of the rig",
        "All parameters", "Views",
    ]  # fmt: skip
    expect(slider(page, "dv_pls")).to_have_attribute("aria-valuetext", "0.2 metres per second")
    expect(slider(page, "r_in")).to_have_attribute(
        "aria-valuetext", re.compile(r"\d newton seconds per metre$")
    )
    names = page.get_by_role("img").evaluate_all("all => all.map(each => each.ariaLabel || '')")
    assert len(names) >= 2  # the picture of what is within reach, and a plot
    assert all(names)


@pytest.mark.long
@pytest.mark.daily("*phone*")
def test_whatever_is_pressed_is_44_pixels_across(page: Page) -> None:
    assert page.evaluate(TOO_SMALL) == []
    for folder in FOLDERS:
        head = page.get_by_role("button", name=folder, exact=True)
        head.click()
        expect(head).to_have_attribute("aria-expanded", "false")
    wait_until(lambda: page.evaluate(TOO_SMALL) == [], "closed folders of which each has its own 44 pixels")
