"""Room in a window: controls, picture, plots beside them; and plots that pause, tell values and are saved."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from browser import DESKTOP, NARROW, NO_PICTURE, PATIENCE_MS, part, readback, visitor
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess
from playwright.sync_api import Browser, Page, expect

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium"), pytest.mark.timeout(900)]

WIDE = (1920, 1080)
CHARTS = "Object.values(window.__viserTestpoints.uplots).map(each => each.chart)"

# The first plot's times, when they have stayed as they are while the panel's beat, of every second, was heard so often:
# many times as long as until a plot is drawn anew. What was on its way to the page may still have come before.
STILL = f"""beats => {{
  const data = {CHARTS}[0].data[0].join(), beat = document.querySelector('[data-beat]').dataset.beat;
  if (window.still?.data !== data) window.still = {{data, beat, heard: 0}};
  if (window.still.beat !== beat) Object.assign(window.still, {{beat, heard: window.still.heard + 1}});
  return window.still.heard >= beats && data;
}}"""


@pytest.fixture(scope="module")
def page(browser: Browser, faked: FakeRig, served: PanelProcess) -> Iterator[Page]:
    with closing(visitor(browser, DESKTOP)) as context:
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.goto(served.address)
        page.add_style_tag(content=NO_PICTURE)
        expect(readback(page, "dv_pls")).to_have_text("0.2m/s")
        yield page


def room(page: Page, size: tuple[int, int], name: str) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    expect(page.locator(f"[data-room={name}]")).to_be_attached()


def panic(page: Page) -> dict[str, float]:
    box = page.get_by_role("button", name="PANIC").bounding_box()
    assert box is not None
    return {side: box[side] for side in ("x", "y", "width", "height")}


def test_a_window_that_was_as_narrow_as_a_phone_gets_the_page_in_its_width_again(page: Page) -> None:
    room(page, DESKTOP, "desk")
    before = panic(page)
    assert before["width"] > 500.0
    room(page, NARROW, "phone")
    room(page, DESKTOP, "desk")
    wait_until(lambda: page.wait_for_timeout(100) or panic(page) == before, f"PANIC at {before} again")


def test_several_plots_stand_beside_the_controls_of_a_wide_window(page: Page) -> None:
    room(page, WIDE, "wide")
    for name in ("Level", "Spectrum"):
        page.get_by_role("button", name=name, exact=True).click()
    expect(part(page, "view")).to_have_text(["Roll", "Level", "Spectrum"])
    boxes = [each.bounding_box() for each in part(page, "view").all()]
    assert all(box is not None and box["x"] + box["width"] < panic(page)["x"] for box in boxes)
    page.wait_for_function(
        f"() => {CHARTS}.every(chart => chart.axes.every(axis => axis._values?.length > 1))"
    )
    page.get_by_role("button", name="Level", exact=True).click()
    expect(part(page, "view")).to_have_text(["Roll", "Spectrum"])
    room(page, DESKTOP, "desk")
    expect(part(page, "view")).to_have_text(["Spectrum"])


def test_a_plot_stands_still_tells_the_values_at_the_cursor_and_is_saved(page: Page, tmp_path: Path) -> None:
    room(page, DESKTOP, "desk")
    page.get_by_role("button", name="Roll", exact=True).click()
    expect(part(page, "view")).to_have_text("Roll")
    page.wait_for_function(f"() => {CHARTS}.every(chart => chart.data[0].length > 20)")
    pause = page.get_by_role("button", name="Pause", exact=True)
    pause.click()
    expect(pause).to_have_attribute("aria-pressed", "true")
    newest = f"() => {CHARTS}[0].data[0].join()"
    still = page.wait_for_function(STILL, arg=2).json_value()
    assert page.evaluate(newest) == still
    plot = page.locator(".u-over").first
    plot.scroll_into_view_if_needed()
    plot.hover()
    expect(page.locator(".u-legend").first.locator(".u-value").nth(1)).to_have_text("23.05")
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save as CSV", exact=True).click()
    text = Path(saved.value.path()).read_text()
    assert saved.value.suggested_filename in ("roll-1.csv", "roll-2.csv")
    assert text.startswith('"time, s","')
    assert len(text.splitlines()) > 20
    pause.click()
    expect(pause).to_have_attribute("aria-pressed", "false")
    page.wait_for_function(f"still => ({newest})() !== still", arg=still)
