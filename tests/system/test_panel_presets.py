"""Presets on the page: kept, chosen, loaded, renamed, deleted, refused."""

from collections.abc import Iterator

import pytest
from axe_playwright_python.sync_playwright import Axe
from browser import PATIENCE_MS, opened, page_at, part, readback, see
from fake_rig import FakeRig, wait_until
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


def press(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def chosen(page: Page, rig: FakeRig, name: str) -> None:
    """A preset that the rig has, chosen in the open folder."""
    opened(page, "Presets")
    rig.somebody_keeps({})  # a button of this name that another test left would go while it is pressed
    see(page, "presets", "No presets yet.")
    rig.somebody_keeps({name: {"dv_pls": 0.3}, "kept": {"dv_pls": 0.2}})
    press(page, name)
    see(page, "preset", f"{name}: chosen")


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
    see(page, "preset", "slow roll: chosen")
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


@pytest.mark.long
def test_a_preset_is_renamed_on_every_page(
    browser: Browser, page: Page, rig: FakeRig, module_panel: PanelProcess
) -> None:
    with page_at(browser, module_panel.address, PATIENCE_MS) as other:
        opened(other, "Presets")
        chosen(page, rig, "slow")
        name_field(page).fill("slow roll")
        press(page, "Rename preset")
        see(page, "preset", "slow: now called slow roll")
        assert rig.presets["slow roll"] == {"dv_pls": 0.3}
        for each in (page, other):
            expect(each.get_by_role("button", name="slow roll", exact=True)).to_have_count(1)
            expect(each.get_by_role("button", name="slow", exact=True)).to_have_count(0)
        press(page, "Load preset")  # it is still the one that is chosen
        see(page, "preset", "slow roll: loaded")
        press(other, "Rename preset")
        see(other, "preset", "slow roll was chosen in another browser")
        name_field(page).fill("kept")
        press(page, "Rename preset")
        see(page, "preset", "Refused: no preset 'slow roll', or 'kept' is there")
        assert len(rig.claims) == 2, "the other page asked for nothing"
        assert set(rig.presets) == {"slow roll", "kept"}


def test_a_preset_is_deleted_by_keyboard_after_a_question(page: Page, rig: FakeRig) -> None:
    chosen(page, rig, "slow")
    sure = page.get_by_role("button", name="Delete for good", exact=True)
    expect(sure).to_be_disabled()
    page.get_by_role("button", name="Delete preset", exact=True).focus()
    panic = page.get_by_role("button", name="PANIC").bounding_box()
    page.keyboard.press("Enter")
    see(page, "preset", "Delete slow for good?")
    see(page, "spoken", "Delete slow for good?")
    expect(page.get_by_role("button", name="Keep preset", exact=True)).to_be_focused()
    assert page.get_by_role("button", name="PANIC").bounding_box() == panic
    assert [each["id"] for each in Axe().run(page).response["violations"]] == []
    press(page, "slow")  # ends the question, also where axe took longer than a question stands
    see(page, "preset", "slow: chosen")
    expect(sure).to_be_disabled()
    page.get_by_role("button", name="Delete preset", exact=True).focus()
    page.keyboard.press("Enter")
    expect(sure).to_be_enabled()
    page.keyboard.press("Escape")  # a PANIC, as always, and no answer
    wait_until(lambda: rig.panics, "the panic")
    page.keyboard.press("Enter")
    see(page, "preset", "slow: kept")
    expect(sure).to_be_disabled()
    expect(part(page, "spoken")).not_to_contain_text("slow")
    assert set(rig.presets) == {"slow", "kept"}
    page.keyboard.press("Enter")
    expect(sure).to_be_enabled()
    page.keyboard.press("Tab")
    expect(sure).to_be_focused()
    page.keyboard.press("Space")
    see(page, "preset", "slow: deleted")
    assert set(rig.presets) == {"kept"}
    expect(page.get_by_role("button", name="slow", exact=True)).to_have_count(0)
    expect(page.get_by_role("button", name="Delete preset", exact=True)).to_be_disabled()
    rig.somebody_keeps({"slow": {"dv_pls": 0.3}, "kept": {"dv_pls": 0.2}})  # another one of that name
    expect(page.get_by_role("button", name="slow", exact=True)).to_have_count(1)
    rig.set_elsewhere("dv_pls", 0.4)
    expect(readback(page, "dv_pls")).to_have_text("0.4m/s")
    expect(page.get_by_role("button", name="Delete preset", exact=True)).to_be_disabled()


@pytest.mark.long
def test_a_click_too_many_deletes_nothing(browser: Browser, page: Page, rig: FakeRig) -> None:
    chosen(page, rig, "slow")
    page.get_by_role("button", name="Delete preset", exact=True).dblclick()
    see(page, "preset", "slow: kept")
    name_field(page).fill("kept")  # to be saved over: the list stays as it is
    for other in ("Load preset", "Save preset", "kept"):  # whatever else is pressed is no answer either
        press(page, "Delete preset")
        expect(page.get_by_role("button", name="Delete for good", exact=True)).to_be_enabled()
        press(page, other)
        expect(page.get_by_role("button", name="Delete for good", exact=True)).to_be_disabled()
    assert set(rig.presets) == {"slow", "kept"}
    press(page, "Delete preset")
    expect(page.get_by_role("button", name="Delete for good", exact=True)).to_be_enabled()
    name_field(page).fill("a third")
    press(page, "Save preset")  # the list changes, and all that stands below it moves
    see(page, "preset", "a third: saved")
    # The list comes after the words, and takes away a question that was asked before it.
    expect(page.get_by_role("button", name="a third", exact=True)).to_have_count(1)
    press(page, "slow")
    press(page, "Delete preset")
    expect(page.get_by_role("button", name="Delete for good", exact=True)).to_be_enabled()
    rig.somebody_keeps({"slow": {"dv_pls": 0.3}, "kept": {"dv_pls": 0.2}})
    expect(page.get_by_role("button", name="Delete for good", exact=True)).to_be_disabled()


@pytest.mark.long
def test_whoever_has_locked_the_tuning_renames_and_deletes(page: Page, rig: FakeRig) -> None:
    opened(page, "Lock tuning")
    press(page, "Lock to me")
    chosen(page, rig, "slow")
    name_field(page).fill("fast")
    press(page, "Rename preset")
    see(page, "preset", "now called fast")
    press(page, "Delete preset")
    press(page, "Delete for good")
    see(page, "preset", "fast: deleted")
    assert len(rig.claims) == 2
    assert all(claim.lease for claim in rig.claims)
    press(page, "Unlock")
