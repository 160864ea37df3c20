"""Announcements of the page to screen readers: what alarms, and nothing else."""

from collections.abc import Iterator

import pytest
from browser import PATIENCE_MS, page_at, part, see, slider
from fake_rig import FakeRig
from panel_process import PanelProcess
from playwright.sync_api import Browser, Page, expect

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]


@pytest.fixture
def rig(faked: FakeRig) -> FakeRig:
    faked.begin_again()
    return faked


@pytest.fixture
def page(browser: Browser, rig: FakeRig, module_panel: PanelProcess) -> Iterator[Page]:
    strangers: list[str] = []
    with page_at(browser, module_panel.address, PATIENCE_MS, strangers) as shown:
        yield shown
    assert strangers == [], "the page wanted another machine"


def is_silent(page: Page) -> None:
    expect(part(page, "spoken")).to_have_text("", timeout=PATIENCE_MS)


def test_a_rig_that_is_ready_or_plays_is_no_alarm_and_a_fault_is_one_until_it_is_over(
    page: Page, rig: FakeRig
) -> None:
    for status, headline in (("playing", "Playing"), ("ready", "Ready")):
        rig.status = status
        see(page, "notice", headline)
        is_silent(page)
    rig.status = "fault: too fast"
    see(page, "spoken", "Fault: too fast")
    rig.status = "ready"
    see(page, "notice", "Ready")
    is_silent(page)
    rig.status = "panic"
    see(page, "spoken", "Panic: zero force")


@pytest.mark.long
def test_a_refusal_is_announced(page: Page, rig: FakeRig) -> None:
    rig.refuse["dv_pls"] = "Ada is tuning"
    thumb = slider(page, "dv_pls")
    thumb.focus()
    thumb.press("ArrowRight")
    see(page, "spoken", "Ada is tuning")
