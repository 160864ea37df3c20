"""From `drumstick up` to a first own strike, and further, by the stopwatch: drumstick lab stopwatch.

A browser that was never here, on a desktop and on a phone, and an OSC client that stands for the DAW. Five ways, one
after the other, each by a script that knows where everything is, so that the machine is measured and the reader is not:
from the command to the panel's address; from there, opened, to the first strike of one's own, by one key of the
keyboard (on a phone by a touch of the drum's head), heard by the DAW; to a roll that is a fifth slower and, within half
a decibel, as loud, by keys on the slider of the rate; to the first strike of another scene. Beside each time: how many
clicks and keys it took. Likewise a phone on the page that is opened to the network, at another address of loopback: it
comes in by the login link that is printed. Kernels are compiled beforehand, but for a cold start of its own, whose
folder of kernels is empty: from the command to the panel's address, and to the first strike that the DAW hears.
"""

import argparse
import math
import os
import re
import statistics
import tempfile
import time
from typing import Any

from browser import DESKTOP, PHONE, chromium, opened, part, readback, slider, visitor
from lan_page import HOST
from playwright.sync_api import Browser, Page, expect
from rig_process import Rig, running, wait_for

from drumstick_lab.benchmarks.network.osc_program import Heard, OscProgram
from drumstick_lab.benchmarks.panel.panel_latency import address
from drumstick_lab.measuring import stored
from ports import free_port

PATIENCE_S = 600.0  # a busy machine takes minutes; whoever waits, waits for an event
SLOWER, LEVEL_dB, STROKES = 0.8, 0.5, 8
SCENE = "tom"
PRINTED = "the command, until it prints the panel's address"
expect.set_options(timeout=1e3 * PATIENCE_S)


class Hand:
    """Clicks and keys of one visitor, counted."""

    def __init__(self, page: Page) -> None:
        self.page, self.clicks, self.keys = page, 0, 0

    def click(self, name: str) -> None:
        """Press a button of the page."""
        self.page.get_by_role("button", name=name, exact=True).click()
        self.clicks += 1

    def key(self, key: str) -> None:
        """Press a key."""
        self.page.keyboard.press(key)
        self.keys += 1


def roll(strikes: list[Heard]) -> tuple[float, float] | None:
    """Rate, Hz, and level of the stick's newest strokes; None before there are enough."""
    own = [each for each in strikes if each.seq >= 0][-STROKES:]
    if len(own) < STROKES or own[-1].came_s <= own[0].came_s:
        return None
    rate_Hz = (STROKES - 1) / (own[-1].came_s - own[0].came_s)
    return rate_Hz, statistics.median(each.level for each in own)


def is_slower(now: tuple[float, float] | None, before: tuple[float, float]) -> bool:
    """True when the rate is a fifth lower and the level the same."""
    if now is None or now[1] <= 0.0:
        return False
    return now[0] <= SLOWER * before[0] and abs(20.0 * math.log10(now[1] / before[1])) <= LEVEL_dB


def login_link(rig: Rig) -> str | None:
    """The link that admits one browser from the network."""
    found = re.search(r"https://\S+\?login=\S+", rig.said)
    return found[0] if found else None


def cold() -> dict[str, dict[str, float]]:
    """Seconds of a start that finds no compiled kernels; nobody clicks."""
    with tempfile.TemporaryDirectory(prefix="drumstick-cold-") as empty:
        before = os.environ.get("XDG_CACHE_HOME")
        os.environ["XDG_CACHE_HOME"] = empty
        try:
            begun = time.monotonic()
            with running("up") as rig:
                daw = OscProgram(rig)
                try:
                    wait_for("the panel's address", lambda: address(rig), PATIENCE_S)
                    printed_s = time.monotonic() - begun
                    wait_for("the roll", lambda: list(daw.strikes), PATIENCE_S)
                    struck_s = time.monotonic() - begun
                finally:
                    daw.close()
        finally:
            if before is None:
                del os.environ["XDG_CACHE_HOME"]
            else:
                os.environ["XDG_CACHE_HOME"] = before
    words = {PRINTED: printed_s, "the command, until the DAW hears the first stroke of the roll": struck_s}
    return {each: {"s": took_s, "clicks": 0, "keys": 0} for each, took_s in words.items()}


def ways(browser: Browser, size: tuple[int, int], network: bool = False) -> dict[str, dict[str, float]]:
    """Seconds, clicks and keys of each way, on a rig of its own; `network`: on the page that is opened to it."""
    place = f"{HOST}:{free_port()}"
    options = ("--panel-lan-at", place) if network else ()
    rows: dict[str, dict[str, float]] = {}
    begun = time.monotonic()
    hand: Hand | None = None

    def note(words: str) -> None:
        nonlocal begun
        now = time.monotonic()
        rows[words] = {
            "s": now - begun, "clicks": hand.clicks if hand else 0, "keys": hand.keys if hand else 0
        }  # fmt: skip
        print(words, rows[words], flush=True)
        if hand is not None:
            hand.clicks = hand.keys = 0
        begun = time.monotonic()

    with running("up", *options) as rig:
        daw = OscProgram(rig)
        try:
            printed = login_link if network else address
            where = wait_for("the panel's address", lambda: printed(rig), PATIENCE_S)
            note(PRINTED)
            page = visitor(browser, size, home=f"https://{place}" if network else None).new_page()
            page.set_default_timeout(1e3 * PATIENCE_S)
            page.goto(where)
            hand = Hand(page)
            hand.clicks += 1  # on the address
            page.locator('[data-part="strike-pad"][data-open]').wait_for(state="attached")  # it hears
            expect(readback(page, "dv_pls")).to_contain_text("m/s")
            if size == PHONE:
                part(page, "strike-pad").tap()
                hand.clicks += 1
            else:
                hand.key("5")
            wait_for("one's own strike", lambda: [s for s in list(daw.strikes) if s.seq < 0], PATIENCE_S)
            note("the page, until the DAW hears the first own strike")
            before = wait_for("the roll", lambda: roll(list(daw.strikes)), PATIENCE_S)
            expect(slider(page, "rate")).to_be_visible()
            begun = time.monotonic()
            slider(page, "rate").focus()
            hand.clicks += 1
            rate = slider(page, "rate")
            wanted = math.log10(0.95 * SLOWER * before[0])
            while float(rate.get_attribute("aria-valuenow") or "nan") > wanted:
                hand.key("ArrowLeft")
            wait_for("the slower roll", lambda: is_slower(roll(list(daw.strikes)), before), PATIENCE_S)
            note("a slower roll of the same loudness, until the DAW hears it")
            opened(page, "Scene")
            hand.clicks += 1
            hand.click(SCENE)
            expect(part(page, "scene-answer")).to_contain_text(f"{SCENE}: chosen")
            hand.click("Play this scene")
            expect(part(page, "scene")).to_have_text(f"Scene: {SCENE}")
            heard = len(daw.strikes)
            wait_for("its strikes", lambda: len(daw.strikes) > heard, PATIENCE_S)
            note("another scene, until the DAW hears it")
            page.context.close()
        finally:
            daw.close()
    return rows


def main() -> None:
    """Measure, tell and store."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    for scene in ("roll", SCENE):
        with running("up", "--scene", scene, "--duration", "1") as warm:
            warm.process.wait(PATIENCE_S)
    with chromium() as browser:
        rows: dict[str, Any] = {
            "desktop": ways(browser, DESKTOP),
            "phone": ways(browser, PHONE),
            "phone, over the network's page": ways(browser, PHONE, network=True),
        }
    rows["a cold start: no kernel is compiled"] = cold()
    stored.store("stopwatch", {"rows": rows})


if __name__ == "__main__":
    main()
