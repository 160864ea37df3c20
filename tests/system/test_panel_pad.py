"""The pad on the page, in a real browser, against a fake haptic side."""

from collections.abc import Iterator

import pytest
from browser import PATIENCE_MS, page_at, part, readback, slider
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess
from panel_wire import dial_port
from playwright.sync_api import Browser, Page, WebSocket, expect

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]
MAX_PADS = 16


@pytest.fixture
def rig(faked: FakeRig) -> FakeRig:
    faked.begin_again()
    return faked


@pytest.fixture
def page(browser: Browser, rig: FakeRig, served: PanelProcess) -> Iterator[Page]:
    with page_at(browser, served.address, PATIENCE_MS) as shown:
        yield shown


def pad_sockets(page: Page) -> list[WebSocket]:
    """Those that the page opens from now on."""
    opened: list[WebSocket] = []
    page.on("websocket", lambda made: opened.append(made) if made.url.endswith("/pointer") else None)
    return opened


@pytest.mark.long
def test_there_is_no_pad_for_a_stick_that_follows_no_pointer(page: Page) -> None:
    assert part(page, "pad").count() == 0


@pytest.mark.long
def test_a_pad_comes_and_goes_with_the_rig_that_follows_a_pointer(page: Page, rig: FakeRig) -> None:
    rig.follow_pointer(True)
    pad = part(page, "pad")
    expect(pad).to_be_visible(timeout=PATIENCE_MS)

    def is_in_the_middle() -> bool:
        earlier = len(rig.pointers)
        pad.hover()  # its middle, when it stands still
        page.mouse.down()
        is_held = pad.get_attribute("data-held") is not None
        if is_held:
            wait_until(lambda: len(rig.pointers) > earlier and rig.pointers[-1].held, "a held pointer")
        page.mouse.up()
        wait_until(lambda: not (rig.pointers and rig.pointers[-1].held), "a pointer that lets go")
        held = [pointer for pointer in rig.pointers[earlier:] if pointer.held]
        return is_held and all(abs(p.lift - 0.5) < 0.05 and abs(p.x) < 0.05 and p.y == 0.0 for p in held)

    # On a busy machine what is above it comes late, and moves it away from under the pointer.
    wait_until(is_in_the_middle, "a pointer in the middle of the pad")
    seqs = [pointer.seq for pointer in rig.pointers]
    assert seqs == sorted(set(seqs))
    rig.follow_pointer(False)
    expect(part(page, "pad")).to_have_count(0, timeout=PATIENCE_MS)


@pytest.mark.long
def test_a_pad_that_comes_and_goes_leaves_no_connection_behind(page: Page, rig: FakeRig) -> None:
    opened = pad_sockets(page)
    pad = part(page, "pad")
    for coming in range(MAX_PADS + 4):
        rig.follow_pointer(True)
        expect(pad).to_be_visible(timeout=PATIENCE_MS)
        pad.focus()
        page.keyboard.down(" ")
        wait_until(lambda: rig.pointers and rig.pointers[-1].held, f"a held pointer, coming {coming}")
        rig.follow_pointer(False)
        expect(pad).to_have_count(0, timeout=PATIENCE_MS)
        wait_until(lambda: not rig.pointers[-1].held, "a pad that was taken away to have let go")
        page.keyboard.up(" ")
    assert len(opened) == MAX_PADS + 4
    wait_until(
        lambda: page.wait_for_timeout(100) or all(each.is_closed() for each in opened), "closed sockets"
    )


@pytest.mark.long
def test_a_pad_without_a_connection_says_so_and_tries_once_a_second(
    page: Page, rig: FakeRig, served: PanelProcess
) -> None:
    others = [dial_port(served.port, path="/pointer", Cookie=served.cookie) for _ in range(MAX_PADS)]
    opened = pad_sockets(page)
    page.evaluate("() => { window.seconds = 0; setInterval(() => { window.seconds += 1; }, 1000); }")
    rig.follow_pointer(True)
    pad = part(page, "pad")
    expect(pad).to_be_visible(timeout=PATIENCE_MS)
    pad.focus()
    page.keyboard.down(" ")
    words = "No connection, the stick does not follow. too many pads are open"
    expect(pad).to_contain_text(words, timeout=PATIENCE_MS)
    wait_until(lambda: page.wait_for_timeout(100) or len(opened) >= 4, "more tries")
    tries = len(opened)
    assert tries <= 2 + page.evaluate("window.seconds")  # by a timer of the same page
    assert rig.pointers == []
    others.pop().close()
    expect(pad).not_to_contain_text("No connection", timeout=PATIENCE_MS)
    wait_until(lambda: rig.pointers and rig.pointers[-1].held, "a held pointer")
    page.keyboard.up(" ")
    for each in others:
        each.close()


@pytest.mark.parametrize("key", ["c", "C"])
def test_c_is_a_hand_on_the_head_whatever_caps_lock_says(page: Page, key: str) -> None:
    part(page, "strike-pad").and_(page.locator("[data-open]")).wait_for()
    page.evaluate(
        """() => {
          window.sent = [];
          const send = WebSocket.prototype.send;
          WebSocket.prototype.send = function (data) { window.sent.push(data); send.call(this, data); };
        }"""
    )
    press = """key => {
      const code = "KeyC", bubbles = true;
      document.body.dispatchEvent(new KeyboardEvent("keydown", { key, code, bubbles }));
      return window.sent.map(each => JSON.parse(each)[2]);
    }"""
    # viser may put another pad in the place of the one that was ready.
    assert set(wait_until(lambda: page.evaluate(press, key), "a choke")) == {0}


def test_undo_hears_its_key_with_caps_lock_on(page: Page, rig: FakeRig) -> None:
    slider(page, "dv_pls").press("ArrowRight")
    expect(readback(page, "dv_pls")).to_have_text("0.205m/s")
    page.evaluate(
        """() => document.documentElement.dispatchEvent(
          new KeyboardEvent("keydown", { key: "Z", code: "KeyZ", ctrlKey: true, bubbles: true }))"""
    )
    expect(readback(page, "dv_pls")).to_have_text("0.2m/s")
