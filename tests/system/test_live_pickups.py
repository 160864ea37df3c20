"""Pickups that are moved by OSC and on the page while a whole rig is played."""

import re
from collections.abc import Iterator

import pytest
import zenoh
from browser import PATIENCE_MS, note, page_at, readback, slider
from osc_port import OscPort
from playwright.sync_api import Browser, expect
from rig_process import Listener, Rig, ask, wait_for
from wav_heard import heard_in

from protocol.messages import Meter, Readback, decode

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]
SCENE = '[stick]\nz_ss_m = 0.05\n[listen]\npickups = [[0.5, 0.6, 0.0]]\npickup_places = "live"\n'


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with heard_in(tmp_path_factory.mktemp("sound") / "heard.wav", SCENE) as started:
        yield started


def test_a_pickup_is_moved_by_osc_and_on_the_page_and_not_beyond_the_rim(
    rig: Rig, session: zenoh.Session, osc: OscPort, browser: Browser
) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    osc.send("/drumstick/param/pickup-1.x", 0.25)
    assert osc.receive("/drumstick/param/pickup-1.x", 0.25)
    told = decode(ask(session, rig.keys.param("pickup-1.x")), Readback)
    assert (told.value, told.pending) == (0.25, False)
    osc.send("/drumstick/play/strike", 0.3, 0.1, 0.5)
    wait_for("a drum that hears there", lambda: meters.got and meters.got[-1].revision >= told.revision)
    osc.send("/drumstick/param/pickup-1.y", 1.0)
    assert "outside the rim" in str(osc.receive("/drumstick/error")[1])
    address = r"http://127\.0\.0\.1:\d+/\?token=\S+"
    wait_for("the panel's address", lambda: re.search(address, rig.said))
    found = re.search(address, rig.said)
    assert found is not None
    with page_at(browser, found[0], PATIENCE_MS) as page:
        expect(readback(page, "pickup-1.x")).to_contain_text("0.25 of the radius", timeout=PATIENCE_MS)
        slider(page, "pickup-1.y").press("End")
        expect(note(page, "pickup-1.y")).to_contain_text("outside the rim", timeout=PATIENCE_MS)
        slider(page, "pickup-1.y").press("ArrowLeft")
        before = decode(ask(session, rig.keys.param("pickup-1.x")), Readback).value
        slider(page, "pickup-1.x").press("ArrowRight")
        assert osc.receive("/drumstick/param/pickup-1.x")[0] > before
