"""The page in a real browser, against a fake haptic side."""

import re
from collections.abc import Iterator
from contextlib import closing

import pytest
from browser import DESKTOP, PATIENCE_MS, PHONE, grasp, note, page_at, part, readback, see, slider, visitor
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess
from playwright.sync_api import Browser, Page, expect

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]


@pytest.fixture
def rig(faked: FakeRig) -> FakeRig:
    faked.begin_again()
    return faked


@pytest.fixture
def page(browser: Browser, rig: FakeRig, served: PanelProcess) -> Iterator[Page]:
    """A page of the test's own: what it unfolds, or says, another one would find."""
    strangers: list[str] = []
    with page_at(browser, served.address, PATIENCE_MS, strangers) as opened:
        yield opened
    assert strangers == [], "the page wanted another machine"


@pytest.fixture(scope="module")
def one_page(browser: Browser, faked: FakeRig, served: PanelProcess) -> Iterator[Page]:
    faked.begin_again()
    strangers: list[str] = []
    with page_at(browser, served.address, PATIENCE_MS, strangers) as opened:
        yield opened
    assert strangers == [], "the page wanted another machine"


@pytest.fixture
def shown(one_page: Page, rig: FakeRig) -> Page:
    """The module's page of the daily tests, which leave nothing on it, when it shows the rig as it is at first."""
    see(one_page, "notice", "Playing")
    expect(readback(one_page, "k_coll")).to_have_text("5000N/m")
    expect(slider(one_page, "dv_pls")).to_have_attribute("aria-valuenow", "0.2")
    return one_page


def position(page: Page, name: str) -> float:
    return float(slider(page, name).get_attribute("aria-valuenow") or "nan")


def test_it_shows_what_the_rig_says(shown: Page) -> None:
    see(shown, "notice", "Playing")
    see(shown, "roll-rate", "23.1Hz")
    see(shown, "v-e", "0.63m/s")
    see(shown, "strike", re.compile(r"Strike \d+0.63m/slevel 0.31"))
    see(shown, "servo", "worst lateness 289 µs")
    see(shown, "sound", "7 xruns")
    expect(readback(shown, "k_coll")).to_have_text("5000N/m")


def test_a_limited_output_is_told_in_words_and_nothing_moves(shown: Page, rig: FakeRig) -> None:
    # At one go: the words are written anew several times a second.
    look = """() => [...document.querySelectorAll('.dr:has(> .dr-room > [data-part="sound"]) > *')].map(room =>
      [room, room.parentElement].map(part => part.getBoundingClientRect())).map(([box, all]) =>
      [box.y - all.y, box.height].map(Math.round))"""
    see(shown, "output", "Output: level −18 dB, peak −6 dB")
    see(shown, "limited", "Output limited: no")
    before = shown.evaluate(look)
    rig.limiting = True
    see(shown, "limited", re.compile(r"Output limited: turn the output down \(\d+ frames since its start\)"))
    assert len(before) == 5
    assert shown.evaluate(look) == before
    rig.limiting = False
    see(shown, "limited", re.compile(r"Output limited: not now \(\d+ frames since its start\)"))


@pytest.mark.long
def test_every_parameter_of_the_table_has_its_control(page: Page, rig: FakeRig) -> None:
    # With rate and level of the roll, when the panel has the scene.
    expect(page.locator("[role=slider]")).to_have_count(len(rig.table) + 2, timeout=PATIENCE_MS)
    expect(page.locator("[data-param=level]")).to_be_visible(timeout=PATIENCE_MS)
    first = ["dv_pls", "k_coll", "rate", "level"]
    assert page.locator("[data-param]").evaluate_all("parts => parts.map(p => p.dataset.param)") == [
        *first,
        *(name for name in rig.table if name not in first),
    ]
    expect(page.get_by_text("Mass of the stick")).not_to_be_visible()
    page.get_by_text("More", exact=True).click()
    expect(page.get_by_text("Mass of the stick")).to_be_visible()


def test_a_moved_slider_asks_and_the_readback_follows(shown: Page, rig: FakeRig) -> None:
    thumb = slider(shown, "dv_pls")
    thumb.focus()
    thumb.press("ArrowRight")
    wait_until(lambda: rig.sets, "a set query")
    assert rig.sets == [("dv_pls", 0.205)]
    expect(readback(shown, "dv_pls")).to_have_text("0.205m/s", timeout=PATIENCE_MS)


@pytest.mark.long
def test_the_stiffness_moves_by_a_share_of_itself(page: Page, rig: FakeRig) -> None:
    thumb = slider(page, "k_coll")
    thumb.focus()
    thumb.press("ArrowRight")
    wait_until(lambda: rig.sets, "a set query")
    name, value = rig.sets[0]
    assert name == "k_coll"
    assert 1.005 < value / 5000.0 < 1.03
    expect(readback(page, "k_coll")).to_have_text(f"{value:.0f}N/m", timeout=PATIENCE_MS)


@pytest.mark.long
def test_who_holds_the_lease_is_shown(page: Page, rig: FakeRig) -> None:
    rig.publish_lease("Ada <b>")
    see(page, "lease", "Locked by Ada <b>")
    rig.publish_lease("")
    expect(part(page, "lease")).to_have_count(0, timeout=PATIENCE_MS)


@pytest.mark.long
def test_while_dragging_the_newest_value_wins(page: Page, rig: FakeRig) -> None:
    x, y = grasp(page, "dv_pls")
    page.mouse.move(x + 120, y, steps=40)
    page.mouse.up()

    def heard() -> float | None:
        # Together: the thumb goes its last step when the page is drawn next, which may be after the mouse let go.
        at = position(page, "dv_pls")
        return at if at > 0.3 and rig.sets[-1:] == [("dv_pls", pytest.approx(at))] else None

    last = wait_until(heard, "the last position as a set")
    values = [value for _, value in rig.sets]
    assert values == sorted(values)
    expect(readback(page, "dv_pls")).to_have_text(f"{last:g}m/s", timeout=PATIENCE_MS)


def test_a_refusal_is_explained_in_place_and_the_slider_returns(shown: Page, rig: FakeRig) -> None:
    rig.refuse["k_coll"] = "contact and pulse could reach 120 N, the limit is 100 N: lower <dv_pls>"
    thumb = slider(shown, "k_coll")
    before = thumb.get_attribute("aria-valuenow")
    assert before is not None
    thumb.focus()
    thumb.press("End")
    expect(note(shown, "k_coll")).to_have_text(f"Refused, 50000 N/m: {rig.refuse['k_coll']}")
    expect(thumb).to_have_attribute("aria-valuenow", before, timeout=PATIENCE_MS)
    expect(readback(shown, "k_coll")).to_have_text("5000N/m")
    rig.refuse.clear()
    thumb.press("ArrowRight")
    expect(note(shown, "k_coll")).to_contain_text("Stiffness of the head", timeout=PATIENCE_MS)


@pytest.mark.long
def test_a_refusal_goes_when_something_else_is_accepted(page: Page, rig: FakeRig) -> None:
    rig.refuse["k_coll"] = "too hard with this pulse"
    slider(page, "k_coll").focus()
    page.keyboard.press("End")
    expect(note(page, "k_coll")).to_contain_text("too hard with this pulse", timeout=PATIENCE_MS)
    rig.latching = True
    rig.set_elsewhere("k_coll", 4000.0)
    expect(note(page, "k_coll")).to_have_text("waits until the stick is above the head", timeout=PATIENCE_MS)


@pytest.mark.long
def test_a_pending_value_says_what_it_waits_for(page: Page, rig: FakeRig) -> None:
    rig.latching = True
    thumb = slider(page, "dv_pls")
    thumb.focus()
    thumb.press("ArrowRight")
    expect(note(page, "dv_pls")).to_have_text("waits until the stick is above the head", timeout=PATIENCE_MS)
    expect(readback(page, "dv_pls")).to_have_text("0.2m/s")
    expect(thumb).to_have_attribute("aria-valuenow", "0.205")
    rig.latch()
    expect(readback(page, "dv_pls")).to_have_text("0.205m/s", timeout=PATIENCE_MS)
    expect(note(page, "dv_pls")).to_contain_text("Speed that one pulse adds")


@pytest.mark.long
def test_values_set_elsewhere_move_the_slider_and_stretch_it(page: Page, rig: FakeRig) -> None:
    rig.set_elsewhere("dv_pls", 0.5)
    expect(readback(page, "dv_pls")).to_have_text("0.5m/s", timeout=PATIENCE_MS)
    expect(slider(page, "dv_pls")).to_have_attribute("aria-valuenow", "0.5", timeout=PATIENCE_MS)
    rig.set_elsewhere("dv_pls", 3.0)
    expect(slider(page, "dv_pls")).to_have_attribute("aria-valuenow", "3", timeout=PATIENCE_MS)
    thumb = slider(page, "dv_pls")
    thumb.focus()
    thumb.press("ArrowLeft")
    # On a busy machine the slider that was stretched may tell its own 3.0 first.
    wait_until(lambda: rig.sets and rig.sets[-1][1] < 3.0, "a set query from the new slider")
    assert 2.5 < rig.sets[-1][1] < 3.0


@pytest.mark.long
def test_an_exact_value_is_sent_by_its_button_only(page: Page, rig: FakeRig) -> None:
    page.get_by_text("More", exact=True).click()
    page.get_by_role("button", name="Set", exact=True).hover()  # waits for the folder to have unfolded
    page.get_by_role("button", name="k_coll", exact=True).click()
    see(page, "exact", "k_coll: 1 .. 1000000 N/m")
    field = page.get_by_role("textbox", name="Value", exact=True)
    field.fill("12345.5")
    field.press("Tab")
    assert rig.sets == []
    page.get_by_role("button", name="Set", exact=True).click()
    wait_until(lambda: rig.sets, "a set query")
    assert rig.sets == [("k_coll", 12345.5)]
    field.fill("-3")
    page.get_by_role("button", name="Set", exact=True).click()
    see(page, "exact", "outside 1 .. 1e+06 N/m")
    field.fill("nan")
    page.get_by_role("button", name="Set", exact=True).click()
    see(page, "exact", "not a finite number")
    assert len(rig.sets) == 1


def test_panic_reaches_the_rig_and_says_what_to_do(shown: Page, rig: FakeRig) -> None:
    shown.get_by_role("button", name="PANIC").click()
    wait_until(lambda: rig.panics, "the panic query")
    see(shown, "notice", "Panic: zero force")
    see(shown, "notice", "drumstick arm")
    expect(part(shown, "panic")).to_have_count(0)


@pytest.mark.long
def test_escape_is_panic_once_and_always(page: Page, rig: FakeRig) -> None:
    """Nothing focused, in a field that is typed in, and with the list of commands open, which it closes as well."""
    # Where viser listens: a PANIC that is slow to be answered is asked again, so that the rig's count tells nothing.
    page.evaluate(
        """() => {
             window.heard = 0;
             document.documentElement.addEventListener('keydown', e => { window.heard += e.key === 'Escape'; });
           }"""
    )
    page.keyboard.press("Escape")
    wait_until(lambda: rig.panics, "the panic query")
    see(page, "spoken", "Panic: zero force")
    assert page.evaluate("heard") == 1
    rig.status = "playing"
    page.get_by_role("button", name="Presets").click()
    field = page.get_by_role("textbox", name="Name")
    field.fill("x")
    field.press("Escape")
    assert page.evaluate("heard") == 2
    page.get_by_role("button", name="Commands and their keys").click()
    commands = page.get_by_placeholder("Search commands...")
    expect(commands).to_be_focused(timeout=PATIENCE_MS)
    page.keyboard.press("Escape")
    assert page.evaluate("heard") == 3
    expect(commands).to_have_count(0, timeout=PATIENCE_MS)
    wait_until(lambda: rig.panics >= 3, "the panic queries from the field and from the list of commands")


@pytest.mark.long
def test_what_is_chosen_is_ticked_and_tools_for_developers_are_not_there(page: Page) -> None:
    expect(page).to_have_title("main: drumstick", timeout=PATIENCE_MS)
    expect(page.locator("button:has(.tabler-icon-adjustments)")).to_be_hidden()
    expect(page.get_by_text("Dev Settings").first).to_be_hidden()
    page.get_by_role("button", name="Scene", exact=True).click()
    tom, other = (page.get_by_role("button", name=name, exact=True) for name in ("tom", "paper-roll"))
    expect(tom).to_have_attribute("aria-pressed", "false", timeout=PATIENCE_MS)
    tom.click()
    expect(tom).to_have_attribute("aria-pressed", "true", timeout=PATIENCE_MS)
    expect(other).to_have_attribute("aria-pressed", "false")


@pytest.mark.long
def test_panic_is_not_lost_between_two_moves_of_a_slider(page: Page, rig: FakeRig) -> None:
    # viser sends one message in 50 ms, the newest; what was clicked between two others would not be heard of.
    page.evaluate(
        """() => {
             const thumb = document.querySelector('[role=slider]');
             const move = () => thumb.dispatchEvent(
               new KeyboardEvent('keydown', {key: 'ArrowRight', code: 'ArrowRight', bubbles: true}));
             const panic = [...document.querySelectorAll('button')].find(b => b.textContent === 'PANIC');
             move(); panic.click(); move();
           }"""
    )
    wait_until(lambda: rig.panics, "the panic query")
    wait_until(lambda: rig.sets, "a set query")


@pytest.mark.long
def test_every_control_has_a_role_and_a_name_and_is_reached_by_tab(page: Page, rig: FakeRig) -> None:
    folders = ("Presets", "Lock tuning", "Scene", "More")
    for name in folders:
        folder = page.get_by_role("button", name=name, exact=True)
        folder.focus()
        folder.press("Enter")
        expect(folder).to_have_attribute("aria-expanded", "true", timeout=PATIENCE_MS)
    symbols = [row.quantity.symbol or name for name, row in rig.table.items()]
    for symbol in symbols:
        expect(page.get_by_role("slider", name=symbol, exact=True)).to_have_count(1)
    k_coll = page.get_by_role("slider", name="K_coll")
    expect(k_coll).to_have_attribute("aria-valuetext", "5000 newtons per metre")
    expect(k_coll).to_have_attribute(
        "aria-description", re.compile(r"1 \.\. 1000000 N/m.*Equation \(2\), \(3\)")
    )
    buttons = [
        "Undo",
        "Redo",
        "A",
        "B",
        "Store in A",
        "Store in B",
        "Load preset",
        "Save preset",
    ]
    buttons += ["Lock to me", "Unlock", "Set", "PANIC"]
    for name in buttons:
        expect(page.get_by_role("button", name=name, exact=name != "PANIC")).to_have_count(1)
    for name in ("Name", "Your name", "Value"):
        expect(page.get_by_role("textbox", name=name, exact=True)).to_have_count(1)

    page.get_by_role("button", name="PANIC").focus()
    reached: list[str] = []
    for _ in range(90):
        page.keyboard.press("Tab")
        role, name = page.evaluate(
            """() => {
                 const here = document.activeElement;
                 return [here.role || here.tagName, here.getAttribute('aria-label') || here.textContent];
               }"""
        )
        if role != "BUTTON" or name not in rig.table:  # those choose what is typed
            reached.append(name)
        if "Set" in reached:
            break
    wanted = ["Δv_pls", "K_coll", "Undo", "Redo", "A", "B", "Store in A", "Store in B", "Presets"]
    wanted += [
        "Name",
        "Save preset",
        "Lock tuning",
        "Your name",
        "Lock to me",
        "Unlock",
    ]
    wanted += [
        "Scene",
        "paper-roll",
        "More",
        *(s for s in symbols if s not in ("Δv_pls", "K_coll")),
        "Value",
        "Set",
    ]
    assert [name for name in reached if name in wanted] == wanted


@pytest.mark.long
def test_panic_stays_in_sight(page: Page) -> None:
    page.get_by_text("More", exact=True).click()
    page.get_by_role("button", name="Set", exact=True).scroll_into_view_if_needed()
    expect(page.get_by_role("button", name="PANIC")).to_be_in_viewport(ratio=0.9)


@pytest.mark.long
def test_a_panic_that_nobody_confirms_is_said_until_somebody_hears_it(
    browser: Browser, own_rig: FakeRig, own_panel: PanelProcess
) -> None:
    # As while another scene starts: no gateway is there for a while.
    with page_at(browser, own_panel.address, PATIENCE_MS) as page:
        own_rig.close()
        page.get_by_role("button", name="PANIC").click()
        see(page, "panic", "PANIC was not confirmed")
        see(page, "notice", re.compile(r"No data from the haptic server for \d+ s"))
        with closing(FakeRig(own_rig.scene, port=own_rig.port, boot=2)) as again:
            wait_until(lambda: again.panics, "the panic query")
            see(page, "notice", "Panic: zero force")
            expect(part(page, "panic")).to_have_count(0)


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
@pytest.mark.long
def test_nothing_is_cut_off(
    browser: Browser, rig: FakeRig, served: PanelProcess, size: tuple[int, int]
) -> None:
    strangers: list[str] = []
    context = visitor(browser, size, strangers)
    page = context.new_page()
    page.goto(served.address)
    expect(part(page, "notice")).to_be_visible()
    see(page, "sound", "xruns")
    see(page, "strike", "Strike")

    def cut() -> list[object]:  # in one go: the page writes its parts anew many times a second
        boxes = page.evaluate(
            """() => [...document.querySelectorAll('[data-part]')].filter(p => p.offsetParent).map(p => {
                 const box = p.getBoundingClientRect();
                 return [p.dataset.part, box.left, box.right, p.scrollWidth - p.clientWidth];
               })"""
        )
        absent = {"roll-rate", "v-e", "strike", "servo", "sound", "readback"} - {box[0] for box in boxes}
        return [*absent, *(box for box in boxes if box[1] < 0.0 or box[2] > size[0] or box[3] > 1)]

    wait_until(lambda: not cut(), "parts of which nothing is cut off")
    expect(page.get_by_role("button", name="PANIC")).to_be_in_viewport(ratio=1.0)
    page.get_by_text("More", exact=True).scroll_into_view_if_needed()
    expect(page.get_by_role("button", name="PANIC")).to_be_in_viewport(ratio=0.9)
    context.close()
    assert strangers == []
