"""The page in a real browser tunes a rig of real processes."""

import json
import re
import subprocess
from collections.abc import Generator, Iterator
from contextlib import contextmanager

import pytest
import zenoh
from browser import NARROW, PATIENCE_MS, grasp, note, opened, part, readback, slider, visitor
from playwright.sync_api import Browser, Page, expect
from rig_process import DRUMSTICK, PATIENCE_S, Listener, Rig, ask, leave, running, wait_for

from haptic_server import files
from protocol.messages import Lease, Meter, Readback, State, Strike, decode
from rig.folder import run_folder
from web_panel.access.lease_access import LEASE_S

pytestmark = [
    pytest.mark.system,
    pytest.mark.real_clock,
    pytest.mark.needs("chromium"),
    # More than the patience of one test's waits; the usual one would end pytest as a whole.
    pytest.mark.timeout(600),
]


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("up", "--scene", "roll") as started:
        wait_for("the panel's address", lambda: address(started))
        yield started


def address(rig: Rig) -> str | None:
    found = re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", rig.said)
    return found[0] if found else None


def visit(browser: Browser, rig: Rig) -> Page:
    page = visitor(browser, NARROW).new_page()
    page.goto(address(rig) or "")
    expect(readback(page, "dv_pls")).to_contain_text("m/s", timeout=PATIENCE_MS)
    return page


@contextmanager
def visiting(browser: Browser, rig: Rig) -> Generator[Page]:
    """A page of the test's own, closed whatever comes: it may hold the lease."""
    page = visit(browser, rig)
    try:
        yield page
    finally:
        page.context.close()


@pytest.fixture(scope="module")
def page(browser: Browser, rig: Rig) -> Iterator[Page]:
    with visiting(browser, rig) as visited:
        yield visited


@pytest.fixture(scope="module")
def other(browser: Browser, rig: Rig) -> Iterator[Page]:
    with visiting(browser, rig) as visited:
        yield visited


def ticked(states: list[State]) -> list[State]:
    """Those of a servo that ticked: one that has no processor for a while tells nothing of its own."""
    return [state for state in states if not state.status.endswith("does not tick")]


@pytest.fixture(autouse=True)
def roll(session: zenoh.Session, rig: Rig) -> None:
    """The scene, in play: a test, or its own first run, may have left another one, or a panic."""
    states = Listener(session, rig.keys.state, State)
    wait_for("a state", lambda: ticked(states.got))
    if ticked(states.got)[-1].status == "panic":
        subprocess.run([*DRUMSTICK, "arm", "--rig", rig.name], check=True, timeout=PATIENCE_S)
        wait_for("the panic's end", lambda: ticked(states.got)[-1].status != "panic")
    if json.loads(ask(session, rig.keys.scene))["name"] != "roll":
        boot = states.got[-1].boot
        ask(session, rig.keys.scene_load, "roll")
        wait_for("another start of the servo", lambda: states.got[-1].boot != boot)


@pytest.fixture
def start(roll: None, session: zenoh.Session, rig: Rig) -> None:
    """The values that a test begins with."""
    ask(session, rig.keys.set_many, {"dv_pls": 0.2, "k_coll": 5000.0})
    wait_for("the start", lambda: value_of(session, rig, "dv_pls") == 0.2)


def value_of(session: zenoh.Session, rig: Rig, name: str) -> float:
    return decode(ask(session, rig.keys.param(name)), Readback).value


def see(page: Page, name: str, text: str) -> None:
    expect(readback(page, name)).to_have_text(text, timeout=PATIENCE_MS)


@pytest.mark.usefixtures("start")
def test_a_slider_changes_the_force_and_both_browsers_show_it(
    page: Page, other: Page, rig: Rig, session: zenoh.Session
) -> None:
    strikes = Listener(session, rig.keys.strike, Strike)
    wait_for("strikes", lambda: len(strikes.got) > 5)
    before = strikes.got[-1].peak_estimate_N
    thumb = slider(page, "k_coll")
    thumb.focus()
    thumb.press("End")
    wait_for("the servo to use it", lambda: value_of(session, rig, "k_coll") == 50_000.0)
    for each in (page, other):
        see(each, "k_coll", "50000N/m")
    # The peak grows as the root of the stiffness, and the roll grows faster besides.
    wait_for("a harder stroke", lambda: strikes.got[-1].peak_estimate_N > 2.0 * before)
    slider(other, "k_coll").focus()
    slider(other, "k_coll").press("ArrowLeft")
    lower = wait_for("the other browser's value", lambda: (v := value_of(session, rig, "k_coll")) < 5e4 and v)
    see(page, "k_coll", f"{lower:.0f}N/m")


@pytest.mark.usefixtures("start")
@pytest.mark.long
def test_a_newcomer_gets_a_faster_roll_with_what_the_page_says(browser: Browser, rig: Rig) -> None:
    """From the printed address, by names and numbers that are on the page: its first slider, some steps to the left."""
    with visiting(browser, rig) as page:
        shown = part(page, "roll-rate")

        def rate() -> float:
            found = re.search(r"\d+\.\d+", shown.inner_text())
            return float(found[0]) if found else 0.0

        wait_for("the roll on the page", lambda: 22.0 < rate() < 24.0)
        first = page.get_by_role("slider").first
        first.focus()
        for _ in range(12):
            first.press("ArrowLeft")
        wait_for("a faster roll on the page", lambda: rate() > 26.0)
        # The last step to the left is not still under way when another test begins.
        see(page, "dv_pls", "0.14m/s")


@pytest.mark.usefixtures("start")
@pytest.mark.long
def test_what_is_computed_is_what_is_then_played(page: Page, rig: Rig, session: zenoh.Session) -> None:
    thumb = slider(page, "dv_pls")
    see(page, "dv_pls", "0.2m/s")
    thumb.focus()
    for _ in range(20):
        thumb.press("ArrowRight")
    see(page, "dv_pls", "0.3m/s")
    told = part(page, "prediction")
    expect(told).to_contain_text("Predicted:", timeout=180_000.0)  # kernels may have to compile first
    expect(told).to_contain_text("stable")
    rate, speed = (float(words) for words in told.locator("b").all_inner_texts())
    states = Listener(session, rig.keys.state, State)
    wait_for(
        "the roll to settle there",
        lambda: (
            states.got
            and abs(states.got[-1].roll_rate_Hz - rate) < 0.3
            and abs(states.got[-1].v_e_m_per_s - speed) < 0.02
        ),
    )


@pytest.mark.long
@pytest.mark.usefixtures("start")
def test_undo_and_a_and_b_set_the_servo(page: Page, rig: Rig, session: zenoh.Session) -> None:
    see(page, "dv_pls", "0.2m/s")
    page.get_by_role("button", name="Store in A", exact=True).click()
    # What B holds depends on whether this test had to begin again.
    expect(part(page, "sets")).to_contain_text("A is on, as it was stored", timeout=PATIENCE_MS)
    slider(page, "dv_pls").focus()
    page.keyboard.press("End")
    see(page, "dv_pls", "1m/s")
    expect(part(page, "sets")).to_contain_text("A is on, changed since: Δv_pls")
    page.get_by_role("button", name="Store in B", exact=True).click()
    expect(part(page, "sets")).to_contain_text("A and B differ in Δv_pls", timeout=PATIENCE_MS)
    page.get_by_role("button", name="A", exact=True).click()
    see(page, "dv_pls", "0.2m/s")
    page.keyboard.press("Control+b")
    see(page, "dv_pls", "1m/s")
    expect(part(page, "sets")).to_contain_text("B is on, as it was stored")
    page.keyboard.press("Control+z")  # the switch
    see(page, "dv_pls", "0.2m/s")
    page.keyboard.press("Control+Shift+z")
    see(page, "dv_pls", "1m/s")
    assert value_of(session, rig, "dv_pls") == 1.0
    for text in ("0.2m/s", "1m/s", "0.2m/s"):
        page.get_by_role("button", name="Undo").click()
        see(page, "dv_pls", text)


@pytest.mark.usefixtures("start")
@pytest.mark.long
def test_a_page_closed_in_mid_drag_leaves_what_was_accepted_last(
    browser: Browser, page: Page, rig: Rig, session: zenoh.Session
) -> None:
    with visiting(browser, rig) as leaving:  # nobody lets go of the thumb
        see(leaving, "dv_pls", "0.2m/s")
        x, y = grasp(leaving, "dv_pls")
        leaving.mouse.move(x + 100, y, steps=20)
        wait_for("the drag to be heard", lambda: value_of(session, rig, "dv_pls") > 0.25)
    # The panel asks for one value after the other: what it asked for before this one has been answered.
    slider(page, "k_coll").press("ArrowRight")
    wait_for("a later request's answer", lambda: value_of(session, rig, "k_coll") != 5000.0)
    left = value_of(session, rig, "dv_pls")
    assert 0.25 < left <= 1.0
    see(page, "dv_pls", f"{left:g}m/s")
    expect(slider(page, "dv_pls")).to_have_attribute("aria-valuenow", f"{left:g}")
    assert value_of(session, rig, "dv_pls") == left
    slider(page, "dv_pls").press("ArrowRight")
    wait_for("the slider to live on", lambda: value_of(session, rig, "dv_pls") > left)


@pytest.mark.usefixtures("start")
@pytest.mark.long
def test_whoever_tunes_alone_is_the_only_one_until_the_page_closes(
    browser: Browser, page: Page, rig: Rig, session: zenoh.Session
) -> None:
    with visiting(browser, rig) as alone:
        opened(alone, "Lock tuning")
        alone.get_by_role("textbox", name="Your name").fill("Ada")
        alone.get_by_role("button", name="Lock to me").click()
        expect(part(page, "lease")).to_contain_text("Locked by Ada", timeout=PATIENCE_MS)
        left_s = [LEASE_S]

        def is_renewed() -> bool:
            left_s.append(decode(ask(session, rig.keys.lease), Lease).left_s)
            return left_s[-1] > left_s[-2]

        for renewal in range(2):
            wait_for(f"renewal {renewal} of the lease", is_renewed)
        slider(page, "dv_pls").focus()
        page.keyboard.press("End")
        expect(note(page, "dv_pls")).to_contain_text("Refused, 1 m/s: Ada is tuning", timeout=PATIENCE_MS)
        see(page, "dv_pls", "0.2m/s")
        # It followed the other page's up to the end, from where the key moves nothing.
        expect(slider(alone, "dv_pls")).to_have_attribute("aria-valuenow", "0.2", timeout=PATIENCE_MS)
        slider(alone, "dv_pls").focus()
        alone.keyboard.press("End")
        see(alone, "dv_pls", "1m/s")
        alone.get_by_role("button", name="Undo").click()
        see(page, "dv_pls", "0.2m/s")
    wait_for("the lease to be given back", lambda: decode(ask(session, rig.keys.lease), Lease).name == "")
    expect(part(page, "lease")).to_have_count(0, timeout=PATIENCE_MS)
    expect(slider(page, "dv_pls")).to_have_attribute("aria-valuenow", "0.2", timeout=PATIENCE_MS)
    page.keyboard.press("End")
    see(page, "dv_pls", "1m/s")


@pytest.mark.long
def test_what_the_envelope_refuses_is_foreseen_and_explained(page: Page, rig: Rig) -> None:
    opened(page, "More")
    page.get_by_role("button", name="dv_pls", exact=True).click()
    page.get_by_role("textbox", name="Value").fill("9")
    page.get_by_role("button", name="Set", exact=True).click()
    refused = re.compile(r"Refused, 9 m/s: .* the limit is [\d.]+ (N|m/s): lower dv_pls")
    expect(note(page, "dv_pls")).to_have_text(refused, timeout=PATIENCE_MS)
    expect(part(page, "prediction")).to_contain_text("The envelope would refuse this", timeout=PATIENCE_MS)
    expect(part(page, "prediction")).to_contain_text("Predicted:", timeout=PATIENCE_MS)


@pytest.mark.usefixtures("start")
@pytest.mark.long
def test_another_scene_and_back_with_its_own_values(page: Page, rig: Rig, session: zenoh.Session) -> None:
    states = Listener(session, rig.keys.state, State)
    meters = Listener(session, rig.keys.meter, Meter)
    ask(session, rig.keys.set_one("dv_pls"), 0.35)
    see(page, "dv_pls", "0.35m/s")
    opened(page, "Scene")

    def play(name: str) -> int:
        before = states.got[-1].boot
        page.get_by_role("button", name=name, exact=True).click()
        expect(part(page, "scene-answer")).to_contain_text(f"{name}: chosen", timeout=PATIENCE_MS)
        page.get_by_role("button", name="Play this scene").click()
        expect(part(page, "scene")).to_have_text(f"Scene: {name}", timeout=PATIENCE_MS)
        wait_for("another start of the servo", lambda: states.got[-1].boot != before)
        return states.got[-1].boot

    boot = play("tom")
    assert rig.process.poll() is None
    see(page, "k_coll", "5000N/m")
    ask(session, rig.keys.set_one("k_coll"), 7000.0)
    see(page, "k_coll", "7000N/m")
    assert play("roll") != boot
    see(page, "dv_pls", "0.35m/s")
    expect(part(page, "notice")).to_contain_text("Playing", timeout=PATIENCE_MS)
    heard = meters.got[-1].played
    wait_for("the drum to sound again", lambda: meters.got[-1].played > heard)
    play("tom")
    see(page, "k_coll", "7000N/m")
    play("roll")
    assert set(rig.children()) >= {"haptic_server.servo", "haptic_server.gateway"}
    assert "restarting" not in rig.said


def test_panic_from_the_page_stops_the_force(page: Page, rig: Rig, session: zenoh.Session) -> None:
    states = Listener(session, rig.keys.state, State)
    wait_for("a playing stick", lambda: states.got and states.got[-1].status == "playing")
    page.keyboard.press("Escape")
    wait_for("the panic", lambda: states.got[-1].status == "panic")
    expect(part(page, "notice")).to_contain_text("Panic: zero force", timeout=PATIENCE_MS)
    first = states.got[-1]
    wait_for("a second of it", lambda: states.got[-1].t_ns - first.t_ns > 1_000_000_000)
    after = [state for state in ticked(states.got) if state.t_ns >= first.t_ns]
    assert {(state.status, state.force_N) for state in after} == {("panic", 0.0)}
    subprocess.run([*DRUMSTICK, "arm", "--rig", rig.name], check=True, timeout=PATIENCE_S)
    expect(part(page, "notice")).to_contain_text("Playing", timeout=PATIENCE_MS)
    page.get_by_role("button", name="PANIC").click()
    wait_for("the panic", lambda: states.got[-1].status == "panic")
    boot = states.got[-1].boot
    opened(page, "Scene")
    page.get_by_role("button", name="tom", exact=True).click()
    page.get_by_role("button", name="Play this scene").click()
    expect(part(page, "scene-answer")).to_contain_text("drumstick arm", timeout=PATIENCE_MS)
    # Whoever gets past the gateway: what is latched stays latched, in the same scene.
    leave(run_folder(rig.name) / files.WANTED, "tom")
    wait_for("the supervisor's word", lambda: "the scene stays" in rig.said)
    last = ticked(states.got)[-1]
    assert (last.boot, last.status, last.force_N) == (boot, "panic", 0.0)
