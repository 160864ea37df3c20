"""A mouse, a finger and a space bar in a real browser play the real instrument: page, panel, wire, gateway, servo."""

import re
from collections.abc import Iterator
from itertools import count

import pytest
import zenoh
from browser import NARROW, PATIENCE_MS, part, readback, visitor
from playwright.sync_api import Browser, Page, expect
from rig_process import Listener, Rig, running, wait_for

from protocol.messages import Pointer, State, Strike, encode

pytestmark = [pytest.mark.system]


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("up", "--device", "pointer") as started:
        yield started


class Strikes(Listener[Strike]):
    """Strikes of a rig, and its states."""

    def __init__(self, session: zenoh.Session, rig: Rig) -> None:
        self._forgotten = 0
        self._states = Listener(session, rig.keys.state, State)
        super().__init__(session, rig.keys.strike, Strike)

    @property
    def newest(self) -> int:
        """Number of the newest strike that was heard."""
        return self.got[-1].seq if self.got else self._forgotten

    def forget(self) -> None:
        self._forgotten = self.newest
        self.got.clear()

    def state(self) -> State:
        return wait_for("a state", lambda: self._states.got[-1] if self._states.got else None)


@pytest.fixture(scope="module")
def strikes(rig: Rig) -> Iterator[Strikes]:
    session = rig.client()
    yield Strikes(session, rig)
    session.close()


def visit(browser: Browser, rig: Rig) -> Page:
    address = wait_for("the panel's address", lambda: re.search(r"panel: (http://\S+)", rig.said))[1]
    context = visitor(browser, NARROW)
    opened = context.new_page()
    opened.goto(address)
    expect(part(opened, "pad")).to_be_visible(timeout=PATIENCE_MS)
    expect(readback(opened, "k_coll")).to_have_text("5000N/m", timeout=PATIENCE_MS)
    part(opened, "pad").hover()  # waits until it no longer moves about
    return opened


@pytest.fixture(scope="module")
def page(browser: Browser, rig: Rig) -> Iterator[Page]:
    opened = visit(browser, rig)
    yield opened
    opened.context.close()


def box(page: Page) -> tuple[float, float, float, float]:
    found = part(page, "pad").bounding_box()
    assert found is not None
    return found["x"], found["y"], found["width"], found["height"]


def press(page: Page, rig: Rig, across: float) -> None:
    """The mouse's button goes down near the top of the pad, `across` of its width from the left."""
    pad = part(page, "pad")
    pad.hover(
        position={"x": across * box(page)[2], "y": 5.0}
    )  # scrolls, and waits until it no longer moves about
    page.mouse.down()
    try:
        expect(pad).to_have_attribute("data-held", "", timeout=PATIENCE_MS)
    except AssertionError as missed:
        raise AssertionError(f"the pad is not held; it says {pad.inner_text()!r}\n{rig.said}") from missed


def push(page: Page, across: float, steps: int) -> None:
    """The held mouse goes down to just above the pad's lower edge."""
    left, top, width, height = box(page)
    page.mouse.move(left + across * width, top + height - 3.0, steps=steps)


def quiet(strikes: Strikes) -> None:
    """Until nothing has struck in 500 ticks of the servo, and all strikes are here: a stick that was let go rings out.

    By its own ticks: where the machine stands still, so does the stick.
    """
    begun = strikes.state()

    def no_more() -> bool:
        nonlocal begun
        state = strikes.state()
        if state.strikes != begun.strikes or state.boot != begun.boot:
            begun = state
        heard = strikes.newest == state.strikes
        return heard and state.ticks >= begun.ticks + 500

    wait_for("silence", no_more)
    strikes.forget()


@pytest.mark.needs("chromium")
def test_a_drag_strikes_where_it_points_and_letting_go_ends_it(
    page: Page, rig: Rig, strikes: Strikes
) -> None:
    quiet(strikes)
    press(page, rig, 0.8)
    push(page, 0.8, steps=10)
    wait_for("a roll under the held mouse", lambda: len(strikes.got) >= 20)
    page.mouse.up()
    quiet(strikes)
    press(page, rig, 0.8)
    push(page, 0.8, steps=3)
    wait_for("a strike", lambda: strikes.got)
    assert strikes.got[-1].x == pytest.approx(0.6, abs=0.05)
    assert strikes.got[-1].y == 0.0
    page.mouse.up()
    quiet(strikes)


@pytest.mark.needs("chromium")
def test_the_space_bar_strikes_and_the_arrows_move_over_the_head(page: Page, strikes: Strikes) -> None:
    quiet(strikes)
    pad = part(page, "pad")
    pad.focus()
    for _ in range(25):
        page.keyboard.press("ArrowLeft")  # wherever it was: to the left edge
    page.keyboard.down(" ")
    wait_for("strikes", lambda: len(strikes.got) >= 5)
    page.keyboard.up(" ")
    assert strikes.got[-1].x == pytest.approx(-1.0, abs=0.01)
    quiet(strikes)


@pytest.mark.needs("chromium")
@pytest.mark.long
def test_a_finger_strikes(page: Page, strikes: Strikes) -> None:
    quiet(strikes)
    left, top, width, height = box(page)
    touch = page.context.new_cdp_session(page)
    point = {"x": left + 0.5 * width, "y": top + height - 4.0}
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [point]})
    wait_for("strikes", lambda: len(strikes.got) >= 3)
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    quiet(strikes)


@pytest.mark.needs("chromium")
@pytest.mark.long
def test_a_page_that_is_closed_lets_go(browser: Browser, rig: Rig, strikes: Strikes) -> None:
    page = visit(browser, rig)
    press(page, rig, 0.5)
    push(page, 0.5, steps=3)
    wait_for("strikes", lambda: len(strikes.got) >= 5)
    page.context.close()
    quiet(strikes)


@pytest.mark.needs("chromium")
def test_the_pad_says_what_it_is(page: Page) -> None:
    pad = part(page, "pad")
    label = pad.get_attribute("aria-label") or ""
    assert "Space" in label
    assert "arrows" in label
    assert pad.get_attribute("tabindex") == "0"


@pytest.mark.long
def test_a_program_points_over_the_wire_and_falls_silent(rig: Rig, strikes: Strikes) -> None:
    session = rig.client()
    states = Listener(session, rig.keys.state, State)
    quiet(strikes)
    sequence = count()

    def pointed() -> bool:
        # Fifty times a second, as a page points, for as long as it takes: a busy machine strikes late.
        payload = Pointer(source="program", seq=next(sequence), held=True, lift=0.0, x=0.3, y=-0.4)
        session.put(rig.keys.pointer, encode(payload))
        return len(strikes.got) >= 3

    wait_for("strikes", pointed)
    assert (strikes.got[-1].x, strikes.got[-1].y) == (pytest.approx(0.3), pytest.approx(-0.4))
    quiet(strikes)  # without a word of letting go
    assert states.got[-1].z_m > 0.0
    session.close()
