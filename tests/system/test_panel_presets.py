"""Presets on the page: kept, chosen, loaded, refused."""

from collections.abc import Iterator

import pytest
from browser import PATIENCE_MS, page_at, readback, see
from fake_rig import FakeRig
from panel_process import PanelProcess
from playwright.sync_api import Browser, Locator, Page, expect

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


def name_field(page: Page) -> Locator:
    return page.get_by_role("textbox", name="Name", exact=True)


@pytest.mark.long
def test_presets_are_kept_and_loaded(page: Page, rig: FakeRig) -> None:
    page.get_by_text("Presets", exact=True).click()
    see(page, "presets", "No presets yet.")
    expect(page.get_by_role("button", name="Load preset")).to_be_disabled()
    name_field(page).fill("slow roll")
    page.get_by_role("button", name="Save preset").click()
    see(page, "preset", "slow roll: saved")
    assert rig.presets == {"slow roll": {"dv_pls": 0.2, "k_coll": 5000.0}}
    rig.set_elsewhere("dv_pls", 0.4)
    expect(readback(page, "dv_pls")).to_have_text("0.4m/s", timeout=PATIENCE_MS)
    page.get_by_role("button", name="slow roll").click(timeout=PATIENCE_MS)
    see(page, "preset", "slow roll: chosen, not loaded yet")
    page.get_by_role("button", name="Load preset").click()
    see(page, "preset", "slow roll: loaded")
    expect(readback(page, "dv_pls")).to_have_text("0.2m/s", timeout=PATIENCE_MS)


@pytest.mark.long
def test_a_preset_that_is_refused_says_why(page: Page, rig: FakeRig) -> None:
    rig.presets["gone"] = {"dv_pls": 0.3}
    page.get_by_text("Presets", exact=True).click()
    name_field(page).fill("another")
    page.get_by_role("button", name="Save preset").click()
    page.get_by_role("button", name="gone").click(timeout=PATIENCE_MS)
    see(page, "preset", "gone: chosen")
    del rig.presets["gone"]
    page.get_by_role("button", name="Load preset").click()
    see(page, "preset", "Refused: no preset 'gone'")
