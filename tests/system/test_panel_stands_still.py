"""Nothing on the page that a hand reaches for moves when words change, at any one size."""

from collections.abc import Callable, Iterator
from itertools import zip_longest
from typing import Any

import pytest
from browser import DESKTOP, NARROW, NO_PICTURE, PATIENCE_MS, PHONE, note, page_at, part, resize, see, slider
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess
from playwright.sync_api import Browser, Locator, Page, expect

pytestmark = [
    pytest.mark.system,
    pytest.mark.long,
    pytest.mark.needs("chromium"),
    pytest.mark.timeout(1800),
]

SIZES = (PHONE, NARROW, DESKTOP, (360, 640), (820, 1180), (1920, 1080))
# Each condition: the servo's status, "" when it is silent, and what the notice says then.
CONDITIONS = (
    ("ready", "Ready"),
    ("playing", "Playing"),
    ("panic", "Panic: zero force"),
    ("fault: late", "Fault: late"),
    (
        "fault: the device reports an overheated motor in its second joint, and a count that jumped",
        "that jumped",
    ),
    ("", "No data from the haptic server"),
)
LONG = "contact and pulse could reach 120.4 N, the limit is 100 N: lower dv_pls to 0.17 m/s or k_coll to 3400 N/m"
# Boxes of what can be pressed or dragged and is not folded away, after the page has been drawn a few times alike.
BOXES = """async () => {
  const look = () => JSON.stringify([...document.querySelectorAll('.mantine-Slider-root, button, [role=button]')]
    .filter(part => part.checkVisibility({visibilityProperty: true, opacityProperty: true}))
    .map(part => [part, part.getBoundingClientRect()])
    .filter(([part, box]) => box.width > 0 && box.height > 0)
    .map(([part, box]) => [part.innerText.split('\\n')[0], box.x, box.y, box.width, box.height]
      .map(each => typeof each === 'number' ? Math.round(10 * each) / 10 : each)));
  let last = '', alike = 0;
  while (alike < 5) {
    await new Promise(drawn => requestAnimationFrame(() => setTimeout(drawn, 50)));
    const now = look();
    alike = now === last ? alike + 1 : 0;
    last = now;
  }
  return JSON.parse(last);
}"""

# A slider that takes the focus was scrolled into view.
TO_THE_TOP = "document.querySelectorAll('.mantine-ScrollArea-viewport').forEach(part => part.scrollTop = 0)"


@pytest.fixture(autouse=True)
def _as_its_scene_has_it(faked: FakeRig) -> None:
    faked.begin_again()


@pytest.fixture
def size() -> tuple[int, int]:
    """Size of the window, unless a test is made for several."""
    return NARROW


@pytest.fixture
def page(browser: Browser, module_panel: PanelProcess, size: tuple[int, int]) -> Iterator[Page]:
    with page_at(browser, module_panel.address, PATIENCE_MS, size=size) as shown:
        shown.evaluate(BOXES)  # until it is drawn alike
        yield shown


def moved(before: list[Any], after: list[Any]) -> list[tuple[Any, Any]]:
    return [(was, now) for was, now in zip_longest(before, after) if was != now]


def refuse(page: Page, rig: FakeRig) -> None:
    for name in ("dv_pls", "k_coll"):
        rig.refuse[name] = LONG
        slider(page, name).focus()
        page.keyboard.press("ArrowRight")
        expect(note(page, name)).to_contain_text("Refused", timeout=PATIENCE_MS)
    slider(page, "rate").focus()
    page.keyboard.press("End")
    expect(part(page, "roll")).to_contain_text("nearest", timeout=PATIENCE_MS)


def wait_for_value(page: Page, rig: FakeRig) -> None:
    rig.refuse.clear()
    rig.latching = True
    slider(page, "dv_pls").focus()
    page.keyboard.press("ArrowRight")
    expect(note(page, "dv_pls")).to_contain_text("waits until", timeout=PATIENCE_MS)


def nothing(page: Page, rig: FakeRig) -> None:
    """As the scene has it."""


def test_panic_sliders_and_buttons_stand_still(page: Page, faked: FakeRig) -> None:
    """Six conditions, and three things that controls, lock and sound may say: 18 states at six sizes."""
    page.add_style_tag(content=NO_PICTURE)
    says: tuple[Callable[[Page, FakeRig], None], ...] = (nothing, refuse, wait_for_value)
    for size in SIZES:
        resize(page, size)
        first: list[Any] = []
        for say, (lease, sounding) in zip(
            says, (("", True), ("technician", False), ("", False)), strict=True
        ):
            faked.begin_again()
            faked.sounding = sounding
            see(page, "notice", "Playing")
            say(page, faked)
            page.evaluate(TO_THE_TOP)
            faked.publish_lease(lease)
            expect(part(page, "lease")).to_have_count(1 if lease else 0)
            for status, words in CONDITIONS:
                faked.mute(not status)
                faked.status = status or faked.status
                see(page, "notice", words)
                boxes = page.evaluate(BOXES)
                assert any(box[0].startswith("PANIC") for box in boxes)
                first = first or boxes
                assert moved(first, boxes) == [], f"{size}, {status}, {say.__name__}"


# Both ends of all that scrolls around PANIC, from top to end and back: its box each time, after a frame, and what lies
# over its middle.
SCROLLED = """async () => {
  const button = [...document.querySelectorAll('button')].find(each => each.innerText.startsWith('PANIC'));
  const around = [];
  for (let part = button.parentElement; part; part = part.parentElement)
    if (['auto', 'scroll'].includes(getComputedStyle(part).overflowY)) around.push(part);
  const found = [];
  for (const far of [0, 1e6, 0]) {
    for (const part of around) part.scrollTop = far;
    await new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(drawn)));
    const box = button.getBoundingClientRect();
    const met = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
    found.push([box.x, box.y, box.width, box.height, Math.max(...around.map(part => part.scrollTop)) > 100,
      button.contains(met)]);
  }
  return found;
}"""


@pytest.mark.parametrize("size", [PHONE, (820, 1180), DESKTOP])
def test_panic_stands_still_while_the_page_scrolls(page: Page) -> None:
    boxes = page.evaluate(SCROLLED)
    assert [box[4:] for box in boxes] == [[False, True], [True, True], [False, True]]
    assert boxes[0][:4] == boxes[1][:4] == boxes[2][:4]
    assert boxes[0][3] >= 44.0
    # What the keyboard reaches is not behind it.
    page.get_by_role("button", name="Undo", exact=True).focus()
    page.evaluate("document.activeElement.scrollIntoView({block: 'start'})")
    focused = page.evaluate("document.activeElement.getBoundingClientRect().top")
    assert focused >= boxes[0][1] + boxes[0][3]


# What lies over PANIC, at nine places of it.
OVER = """() => {
  const button = [...document.querySelectorAll('button')].find(each => each.innerText.startsWith('PANIC'));
  const box = button.getBoundingClientRect(), met = [];
  for (const across of [0.02, 0.5, 0.98]) for (const down of [0.05, 0.5, 0.95]) {
    const part = document.elementFromPoint(box.x + across * box.width, box.y + down * box.height);
    if (!button.contains(part)) met.push(part ? part.className : 'nothing');
  }
  return met;
}"""


def palette(page: Page) -> Locator:
    page.keyboard.press("Control+k")
    return page.get_by_placeholder("Search commands...")


def enlarged_plot(page: Page) -> Locator:
    page.locator(".uplot-container").first.hover()
    page.locator("button:has(.tabler-icon-maximize)").first.click()
    return page.locator(".mantine-Modal-content .uplot-container")


@pytest.mark.parametrize("size", [PHONE, (820, 1180), DESKTOP])
def test_what_opens_over_the_page_leaves_panic_free(page: Page, faked: FakeRig) -> None:
    button = page.locator("div:has(> .dr-panic) + div button")  # the palette has a Panic of its own
    before = button.bounding_box()
    assert before is not None
    for opens in (palette, enlarged_plot):
        faked.panics = 0
        open_ = opens(page)
        expect(open_).to_be_visible()
        page.evaluate(BOXES)  # until it has come to rest
        assert page.evaluate(OVER) == []
        expect(open_).to_be_in_viewport(ratio=1.0)
        assert button.bounding_box() == before
        page.mouse.click(before["x"] + before["width"] / 2, before["y"] + before["height"] / 2)
        wait_until(lambda: faked.panics, "the panic")
        expect(open_).to_have_count(0)  # as by Esc


@pytest.mark.parametrize("size", [PHONE])
def test_a_tooltip_leaves_panic_in_sight(page: Page) -> None:
    button, tooltip = (
        page.locator("div:has(> .dr-panic) + div button"),
        page.locator(".mantine-Tooltip-tooltip"),
    )
    scroll = "by => document.querySelector('.mantine-ScrollArea-viewport:has(.dr-panic)').scrollBy(0, by)"
    before, moved = button.bounding_box(), slider(page, "dv_pls")
    at = moved.bounding_box()
    assert before is not None
    assert at is not None
    page.evaluate(scroll, at["y"] - before["y"] - 2.0 * before["height"])
    moved.hover(force=True)
    expect(tooltip).to_be_visible()
    page.evaluate(BOXES)
    shown = tooltip.bounding_box()
    assert shown is not None
    assert (
        shown["y"] < before["y"] + before["height"] / 2.0 < shown["y"] + shown["height"]
    )  # it would lie there
    tooltip.evaluate(
        "each => { each.style.pointerEvents = 'auto'; }"
    )  # clicks go through it; it is seen all the same
    assert page.evaluate(OVER) == []


# What is met above and beside PANIC, from the top of what scrolls, but for the bar that it lies in and viser's head,
# which lies over all and hears no finger.
ABOVE = """async () => {
  const bar = document.querySelector('div:has(> .dr-panic) + div');
  const head = document.querySelector('div[style*="width: 20em"] > div:has(> button .tabler-icon-list-search)');
  const view = bar.closest('.mantine-ScrollArea-viewport');
  const top = head.getBoundingClientRect(), found = new Set();
  for (const far of [60, 130, 200, 270, 340]) {
    view.scrollTop = far;
    await new Promise(drawn => requestAnimationFrame(() => requestAnimationFrame(drawn)));
    const all = view.getBoundingClientRect(), box = bar.querySelector('button').getBoundingClientRect();
    for (let y = all.top + 0.25; y < box.bottom; y += 0.5)
      for (let x = all.left + 1; x < all.right; x += 12) {
        const part = document.elementFromPoint(x, y), isHead = y > top.top && y < top.bottom;
        if (!isHead && !bar.contains(part) && !part.closest('.mantine-ScrollArea-scrollbar'))
          found.add(`${x - box.left} ${Math.round(2 * (y - box.top)) / 2} from its corner: ${part.className}`);
      }
  }
  return [...found];
}"""


@pytest.mark.parametrize("size", [PHONE, (360, 640)])
def test_nothing_shows_above_or_beside_panic_on_a_phone_that_scrolls(page: Page) -> None:
    assert page.evaluate(ABOVE) == []


@pytest.mark.parametrize("size", [PHONE])
def test_the_head_of_the_page_does_not_fold_panic_away_on_a_phone(page: Page) -> None:
    button = page.get_by_role("button", name="PANIC")
    head = page.get_by_role("button", name="Commands and their keys").bounding_box()
    assert head is not None
    before = button.bounding_box()
    page.touchscreen.tap(head["x"] - 100.0, head["y"] + head["height"] / 2)
    page.evaluate(BOXES)
    assert button.bounding_box() == before
    expect(button).to_be_in_viewport(ratio=1.0)
