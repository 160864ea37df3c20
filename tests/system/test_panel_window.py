"""Room in a window: controls, picture, plots beside them; and plots that zoom, pause, tell values and are saved."""

from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path

import pytest
from browser import DESKTOP, NARROW, NO_PICTURE, PHONE, part, readback, visitor
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess
from playwright.sync_api import Browser, Page, expect

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium"), pytest.mark.timeout(900)]

WIDE = (1920, 1080)
VIEWS = ("Roll", "Level", "Orbit", "Return map", "Spectrum", "Accuracy", "Health")
CHARTS = "Object.values(window.__viserTestpoints.uplots).map(each => each.chart)"
# All plots from top to bottom: both ends of their horizontal axes, and a text of their data that changes with these.
ENDS = f"""() => {CHARTS}
  .sort((one, other) => one.root.getBoundingClientRect().top - other.root.getBoundingClientRect().top)
  .map(chart => [chart.scales.x.min, chart.scales.x.max, chart.data.map(column => column.join()).join()])"""

# The first plot's times, when they have stayed as they are while the panel's beat, of every second, was heard so often:
# many times as long as until a plot is drawn anew. What was on its way to the page may still have come before.
STILL = f"""beats => {{
  const data = {CHARTS}[0].data[0].join(), beat = document.querySelector('[data-beat]').dataset.beat;
  if (window.still?.data !== data) window.still = {{data, beat, heard: 0}};
  if (window.still.beat !== beat) Object.assign(window.still, {{beat, heard: window.still.heard + 1}});
  return window.still.heard >= beats && data;
}}"""

# From here on each canvas keeps the texts that were drawn on it since it was cleared, with the boxes of their letters.
KEEP_TEXTS = """(() => {
  const pen = CanvasRenderingContext2D.prototype, {clearRect, fillText} = pen;
  pen.clearRect = function (...box) {
    this.canvas.texts = [];
    return clearRect.apply(this, box);
  };
  pen.fillText = function (text, x, y, ...more) {
    const size = this.measureText(text), turned = this.getTransform(), xs = [], ys = [];
    for (const across of [-size.actualBoundingBoxLeft, size.actualBoundingBoxRight])
      for (const down of [-size.actualBoundingBoxAscent, size.actualBoundingBoxDescent]) {
        const corner = turned.transformPoint({x: x + across, y: y + down});
        xs.push(corner.x);
        ys.push(corner.y);
      }
    const box = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
    if (text) this.canvas.texts.push({text, box});
    return fillText.call(this, text, x, y, ...more);
  };
})()"""
# Of each plot what is wrong with its texts; its names are drawn on it like numbers, its legend lies below it.
WRONG = f"""() => {CHARTS}.flatMap(chart => {{
  const {{canvas}} = chart.ctx, on = canvas.getBoundingClientRect(), dot = on.width / canvas.width, wrong = [];
  const drawn = canvas.texts.map(({{text, box}}) => ({{text, box: box.map(side => side * dot)}}));
  const below = [...chart.root.querySelectorAll('.u-series > *')].map(part => {{
    const box = part.getBoundingClientRect();
    const sides = [box.left - on.left, box.top - on.top, box.right - on.left, box.bottom - on.top];
    return {{text: part.innerText, box: sides}};
  }});
  drawn.forEach(({{text, box: [left, top, right, bottom]}}, index) => {{
    if (left < 0 || top < 0 || right > on.width || bottom > on.height) wrong.push(`${{text}} is cut`);
    for (const {{text: other, box}} of [...drawn.slice(index + 1), ...below])
      if (left < box[2] && box[0] < right && top < box[3] && box[1] < bottom)
        wrong.push(`${{text}} lies over ${{other}}`);
  }});
  for (const axis of chart.axes) {{
    const numbers = axis._values.filter(number => number);
    if (numbers.length < 2 || new Set(numbers).size < numbers.length) wrong.push(`${{axis.label}}: ${{numbers}}`);
    if (!drawn.some(({{text}}) => text === axis.label)) wrong.push(`no name: ${{numbers}}`);
  }}
  return wrong;
}})"""
ALL_DRAWN = f"""count => {CHARTS}.length === count && {CHARTS}.every(chart =>
  chart.axes.every(axis => axis._values?.length > 1))"""


@pytest.fixture(scope="module")
def page(browser: Browser, faked: FakeRig, served: PanelProcess) -> Iterator[Page]:
    faked.begin_again()
    with closing(visitor(browser, DESKTOP)) as context:
        page = context.new_page()
        page.add_init_script(KEEP_TEXTS)
        page.goto(served.address)
        page.add_style_tag(content=NO_PICTURE)
        expect(readback(page, "dv_pls")).to_have_text("0.2m/s")
        yield page


def room(page: Page, size: tuple[int, int], name: str) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    expect(page.locator(f"[data-room={name}]")).to_be_attached()


def wide_with(page: Page, first: str, *more: str) -> None:
    """A wide window with these views: the first one is there before the window is, which comes before its panel does,
    and a button that is pressed once more takes its view away.
    """
    room(page, DESKTOP, "desk")
    page.get_by_role("button", name=first, exact=True).click()
    expect(part(page, "view")).to_have_text([first])
    room(page, WIDE, "wide")
    expect(part(page, "view")).to_have_text([first])
    # Each when the one before is there: of clicks within 50 ms viser sends the last one only.
    for name in more:
        page.get_by_role("button", name=name, exact=True).click()
        expect(part(page, "view").get_by_text(name, exact=True)).to_be_attached()
    expect(part(page, "view")).to_have_text([first, *more])


def nothing_is_wrong(page: Page) -> None:
    """Once the plots have been drawn in the size that they have now."""
    found: list[str] = []

    def is_right() -> bool:
        found[:] = page.evaluate(WRONG)
        return not found

    with suppress(AssertionError):
        wait_until(is_right, "plots with nothing wrong")
    assert found == []


def panic(page: Page) -> dict[str, float]:
    box = page.get_by_role("button", name="PANIC").bounding_box()
    assert box is not None
    return {side: box[side] for side in ("x", "y", "width", "height")}


def panic_at_rest(page: Page) -> dict[str, float]:
    """Its place in two looks one after the other: what follows a change of the window's size moves it."""
    found = [panic(page)]

    def rests() -> bool:
        page.wait_for_timeout(100)
        found.append(panic(page))
        return found[-1] == found[-2]

    wait_until(rests, "PANIC at rest")
    return found[-1]


def test_a_window_that_was_as_narrow_as_a_phone_gets_the_page_in_its_width_again(page: Page) -> None:
    room(page, DESKTOP, "desk")
    before = panic_at_rest(page)
    assert before["width"] > 500.0
    room(page, NARROW, "phone")
    room(page, DESKTOP, "desk")
    wait_until(lambda: page.wait_for_timeout(100) or panic(page) == before, f"PANIC at {before} again")


def test_panic_stands_still_while_it_is_pressed(page: Page) -> None:
    room(page, DESKTOP, "desk")
    before = panic_at_rest(page)
    page.mouse.move(before["x"] + before["width"] / 2, before["y"] + before["height"] / 2)
    page.mouse.down()
    try:
        expect(page.locator("button:active")).to_contain_text("PANIC")
        assert panic(page) == before
    finally:
        page.mouse.move(0, 0)  # let go elsewhere, which is no click
        page.mouse.up()


def test_several_plots_stand_beside_the_controls_of_a_wide_window(page: Page) -> None:
    wide_with(page, "Roll", "Level", "Spectrum")
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


@pytest.mark.parametrize("view", ["Roll", "Level"])  # ends of the axis: given, and those of the data
def test_a_drag_zooms_one_plot_until_a_double_click(page: Page, view: str) -> None:
    room(page, DESKTOP, "desk")
    page.get_by_role("button", name=view, exact=True).click()
    expect(part(page, "view")).to_have_text(view)
    page.wait_for_function(f"() => {CHARTS}.every(chart => chart.data[0].length > 20)")
    (low, high, _), *others = page.evaluate(ENDS)
    plot = page.locator(".u-over").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    assert box is not None
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 4, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 3 / 4, middle, steps=3)
    page.mouse.up()
    wanted = pytest.approx([low + (high - low) / 4, low + (high - low) * 3 / 4], abs=(high - low) / 50)
    (*zoomed, data), *beside = page.evaluate(ENDS)
    assert zoomed == wanted
    assert [ends[:2] for ends in beside] == [ends[:2] for ends in others]
    page.wait_for_function(f"data => ({ENDS})()[0][2] !== data", arg=data)
    assert page.evaluate(ENDS)[0][:2] == wanted, "what is new took the zoom away"
    plot.dblclick()
    assert page.evaluate(ENDS)[0][:2] == pytest.approx([low, high])


def test_no_text_of_any_plot_of_a_wide_window_is_cut_or_lies_over_another(page: Page) -> None:
    wide_with(page, *VIEWS)
    page.wait_for_function(ALL_DRAWN, arg=len(VIEWS) + 2)  # two views have two plots
    nothing_is_wrong(page)


@pytest.mark.parametrize(("view", "plots"), [("Roll", 2), ("Accuracy", 2), ("Health", 1)])
def test_no_text_of_the_fullest_plots_of_a_phone_is_cut_or_lies_over_another(
    page: Page, view: str, plots: int
) -> None:
    room(page, PHONE, "phone")
    page.get_by_role("button", name=view, exact=True).click()
    expect(part(page, "view")).to_have_text(view)
    page.wait_for_function(ALL_DRAWN, arg=plots)
    nothing_is_wrong(page)


def test_the_number_at_the_end_of_an_axis_is_whole_on_a_slow_machine_too(page: Page) -> None:
    room(page, PHONE, "phone")
    page.get_by_role("button", name="Accuracy", exact=True).click()
    expect(part(page, "view")).to_have_text("Accuracy")
    page.wait_for_function(ALL_DRAWN, arg=2)
    page.evaluate(f"() => {CHARTS}.forEach(chart => chart.setScale('x', {{min: 1, max: 100000}}))")
    drawn = f"() => {CHARTS}.every(chart => chart.ctx.canvas.texts.some(({{text}}) => text === '100,000'))"
    page.wait_for_function(drawn)
    nothing_is_wrong(page)


def test_roll_and_orbit_stand_whole_in_a_wide_window(page: Page) -> None:
    wide_with(page, "Roll", "Orbit")
    page.wait_for_function(ALL_DRAWN, arg=3)
    legends = page.locator(".u-legend")
    expect(legends).to_have_count(3)

    expect(part(page, "missing")).to_have_count(0)  # a line above a plot has no room

    def stand_whole() -> bool:
        boxes = [each.bounding_box() for each in legends.all()]
        return all(box is not None and box["y"] + box["height"] <= WIDE[1] for box in boxes)

    wait_until(stand_whole, "legends within the window")
