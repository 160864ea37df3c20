"""The drum without the stick: strikes that are played by OSC, Zenoh and the page, through a whole rig."""

import json
import math
import re
import socket
import statistics
import time
from collections.abc import Iterator
from itertools import pairwise

import msgspec
import pytest
import zenoh
from browser import PATIENCE_MS, page_at, part
from osc_port import OscPort
from playwright.sync_api import Browser, Page, expect
from rig_process import Listener, Rig, ask, reason_of, reply_to, running, wait_for

from haptic_server.gateway.play_rate_limit import OF_ONE
from osc_bench import built
from protocol.messages import STICK, LeaseRequest, Meter, Release, State, Strike, decode, encode

pytestmark = pytest.mark.system
ROLL_HZ = 23.05  # the reference's limit cycle of set A with the exit pulse


# By the page itself, at times that it makes, since a busy machine moves the mouse too slowly: over the radius in 25 ms.
_SWING = """pad => {
  const box = pad.getBoundingClientRect(), middle = { clientY: box.top + box.height / 2, bubbles: true };
  const at = (share) => ({ ...middle, clientX: box.left + box.width * share, pointerType: "mouse", pressure: 0.5 });
  const begun = performance.now();
  const dispatch = (event, ms) => pad.dispatchEvent(Object.defineProperty(event, "timeStamp", { value: begun + ms }));
  for (let step = 0; step <= 5; step++) dispatch(new PointerEvent("pointermove", at(step / 10)), 5 * step);
  dispatch(new PointerEvent("pointerdown", { ...at(0.5), button: 0 }), 30);
}"""

# More than a panel that a busy machine holds up passes on one by one, each when there is room for it again.
_FLOOD = """() => {
  for (let count = 0; count < 300; count++) document.dispatchEvent(new KeyboardEvent("keydown", { code: "Digit5" }));
}"""


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("up") as started:
        yield started


def played(strikes: Listener[Strike], way: str) -> list[Strike]:
    return [strike for strike in strikes.got if strike.source.startswith(way)]


def is_at_rest(meters: Listener[Meter]) -> bool:
    """True when no strike came in the last half second, in time or late."""
    return len(meters.got) > 5 and came(meters.got[-1]) == came(meters.got[-6]) > 0


def is_silent(states: list[State], strikes: Listener[Strike]) -> bool:
    """True when in a panic the stick has not struck in 500 of its ticks, and its newest strike is here."""
    last = states[-1]
    since = next(state for state in states if state.strikes == last.strikes)
    is_here = played(strikes, STICK)[-1].seq == last.strikes
    return is_here and last.status == "panic" and last.ticks >= since.ticks + 500


def came(meter: Meter) -> int:
    """Strikes that reached the sound server: where the machine stood still one comes too late to be played."""
    return meter.played + meter.late


def test_beside_the_roll_a_strike_by_osc_is_told_everywhere_with_numbers_of_its_own(
    rig: Rig, session: zenoh.Session, osc: OscPort
) -> None:
    strikes = Listener(session, rig.keys.strike, Strike)
    releases = Listener(session, rig.keys.release, Release)
    wait_for("the roll", lambda: len(strikes.got) > 5)
    osc.send("/drumstick/play/strike", 0.5, -0.25, 0.75)
    (struck,) = wait_for("the strike", lambda: played(strikes, "osc 127.0.0.1"))
    assert (struck.x, struck.y, struck.level, struck.z_speed_m_per_s) == (0.5, -0.25, 0.75, 1.5)
    assert struck.boot not in {each.boot for each in strikes.got if each.source == STICK}
    release = wait_for("its release", lambda: next((r for r in releases.got if r.source != STICK), None))
    assert (release.boot, release.seq) == (struck.boot, struck.seq)
    values = osc.receive("/drumstick/strike", -struck.seq)
    assert values[1:5] == [0.5, -0.25, 1.5, 0.75]
    assert osc.receive("/drumstick/release", -struck.seq)[4] == pytest.approx(release.contact_s)


@pytest.mark.parametrize("level", [math.nan, 1e30, -1.0])
def test_numbers_that_no_strike_has_are_answered(osc: OscPort, level: float) -> None:
    osc.send("/drumstick/play/strike", 0.0, 0.0, level)
    address, why = osc.receive("/drumstick/error", None)
    assert address == "/drumstick/play/strike"
    assert "level" in str(why)


def test_a_flood_is_held_back_and_the_roll_goes_on(rig: Rig, session: zenoh.Session) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    strikes = Listener(session, rig.keys.strike, Strike)
    before = wait_for("a meter", lambda: meters.got and meters.got[-1])
    strike = built("/drumstick/play/strike", 0.1, 0.1, 0.2)

    def by_stick() -> list[Strike]:
        return [strike for strike in list(strikes.got) if strike.source == STICK]

    def goes_on() -> bool:
        for _ in range(50):  # no more than the gateway's socket keeps
            flood.sendto(strike, ("127.0.0.1", rig.osc_in))
        held_back = json.loads(ask(session, rig.keys.doctor))["played"].get("held_back", 0)
        return held_back > 500 and len(by_stick()) > 30

    begun = time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flood:
        wait_for("a flood that is held back, and the roll amid it", goes_on)
    lasted_s = time.monotonic() - begun
    stick = by_stick()
    assert [each.seq for each in stick] == list(range(stick[0].seq, stick[0].seq + len(stick)))
    # By the servo's own clock, and at the middle of all: a stall of the machine makes one of them long.
    apart_s = 1e-9 * statistics.median(b.t_ns - a.t_ns for a, b in pairwise(stick))
    assert 1.0 / apart_s == pytest.approx(ROLL_HZ, rel=0.05)
    assert len(played(strikes, "osc")) <= OF_ONE.at_once + OF_ONE.per_s * (lasted_s + 1.0)
    assert meters.got[-1].duplicates == before.duplicates


def test_beside_somebodys_lease_strikes_still_play(rig: Rig, session: zenoh.Session, osc: OscPort) -> None:
    strikes = Listener(session, rig.keys.strike, Strike)
    lease = encode(LeaseRequest(who="secret", name="Ada"))
    assert reply_to(session, rig.keys.lease, lease).ok is not None
    assert decode(ask(session, rig.keys.play_strike, [0.0, 0.2, 0.5]), Strike).source == "zenoh"
    # Again and again: behind what is left of a flood it may be held back.
    wait_for(
        "a strike by OSC",
        lambda: played(strikes, "osc") or osc.send("/drumstick/play/strike", 0.0, 0.2, 0.5),
    )
    assert (
        reply_to(session, rig.keys.lease, lease).ok is not None
    )  # anew: it lasts 5 s, and that may have taken longer
    assert "Ada is tuning" in reason_of(
        reply_to(session, rig.keys.set_one("dv_pls"), msgspec.msgpack.encode([1, 0.2]))
    )
    given_back = encode(LeaseRequest(who="secret", name="Ada", seconds=0.0))
    assert reply_to(session, rig.keys.lease, given_back).ok is not None


@pytest.fixture(scope="module")
def page(rig: Rig, browser: Browser) -> Iterator[Page]:
    address = wait_for(
        "the panel's address",
        lambda: next((line.split("panel: ")[1] for line in rig.lines if "panel: http" in line), None),
    )
    with page_at(browser, address, PATIENCE_MS) as shown:
        shown.locator('[data-part="strike-pad"][data-open]').wait_for()
        yield shown


@pytest.mark.needs("chromium")
def test_keys_play_from_soft_to_hardest(page: Page, rig: Rig, session: zenoh.Session) -> None:
    strikes = Listener(session, rig.keys.strike, Strike)
    for count, key in enumerate("1590", 1):
        page.keyboard.press(key)
        wait_for(f"strike {count}", lambda count=count: len(played(strikes, "zenoh page")) == count)
    assert [strike.level for strike in played(strikes, "zenoh page")] == [0.1, 0.5, 0.9, 1.0]
    page.keyboard.down("3")
    page.keyboard.down("3")  # held: it repeats
    page.keyboard.up("3")
    part(page, "strike-pad").focus()
    page.keyboard.press("Shift+Enter")
    wait_for("the accent", lambda: len(played(strikes, "zenoh page")) == 6)
    assert [strike.level for strike in played(strikes, "zenoh page")[4:]] == [0.3, 1.0]


@pytest.mark.needs("chromium")
def test_a_short_click_strikes_where_it_falls_as_hard_as_it_comes(
    page: Page, rig: Rig, session: zenoh.Session
) -> None:
    strikes = Listener(session, rig.keys.strike, Strike)
    pad = part(page, "strike-pad")
    pad.hover()
    box = pad.bounding_box()
    assert box is not None
    width, height = box["width"], box["height"]
    pad.click(position={"x": 0.75 * width, "y": 0.5 * height}, delay=30)
    (rested,) = wait_for("a click", lambda: played(strikes, "zenoh page"))
    assert (rested.x, rested.y) == pytest.approx((0.5, 0.0), abs=0.05)
    pad.click(position={"x": 0.5 * width, "y": 0.25 * height}, delay=30, modifiers=["Shift"])
    wait_for("an accent", lambda: len(played(strikes, "zenoh page")) == 2)
    accent = played(strikes, "zenoh page")[1]
    assert (accent.level, accent.y) == (1.0, pytest.approx(0.5, abs=0.05))
    pad.evaluate(_SWING)
    wait_for("a swing", lambda: len(played(strikes, "zenoh page")) == 3)
    assert played(strikes, "zenoh page")[2].level > 0.7


@pytest.mark.needs("chromium")
def test_the_page_says_why_nothing_was_struck(page: Page) -> None:
    part(page, "strike-pad").evaluate(_FLOOD)
    # By the limit of strikes, or where a busy gateway has still to answer those before, by that of queries.
    why = re.compile(r"Refused: .*too many (queries )?at once")
    expect(page.locator(".dr-play")).to_contain_text(why, timeout=PATIENCE_MS)


def test_in_a_panic_each_strike_still_sounds_once(rig: Rig, session: zenoh.Session, osc: OscPort) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    states = Listener(session, rig.keys.state, State)
    strikes = Listener(session, rig.keys.strike, Strike)
    wait_for("the roll", lambda: meters.got and came(meters.got[-1]) and played(strikes, STICK))
    ask(session, rig.keys.panic)
    wait_for("silence of the stick", lambda: states.got and is_silent(list(states.got), strikes))
    seen = len(meters.got)
    wait_for("rest", lambda: len(meters.got) > seen + 6 and is_at_rest(meters))
    before, heard, struck = meters.got[-1], len(meters.got), 0
    all_ = came(before)
    while meters.got[-1].played < before.played + 10:
        if struck % 2:
            osc.send("/drumstick/play/strike", 0.3, 0.0, 1.0)
        else:
            told = decode(ask(session, rig.keys.play_strike, [0.0, 0.3, 1.0, "test"]), Strike)
            assert told.source == "zenoh test"
        struck, all_ = struck + 1, all_ + 1
        wait_for("it", lambda sum_=all_: came(meters.got[-1]) >= sum_)
    last = len(meters.got)
    wait_for("rest", lambda: len(meters.got) > last + 6 and is_at_rest(meters))
    after = meters.got[-1]
    assert (came(after), after.duplicates, after.refused) == (all_, before.duplicates, before.refused)
    assert max(meter.peak_left for meter in meters.got[heard:]) > 0.05
