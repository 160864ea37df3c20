"""Rate and level on the page: two sliders, what is within reach, a refusal in place, undo."""

import pytest
from browser import PATIENCE_MS, part
from fake_rig import FakeRig, wait_until
from playwright.sync_api import Page, expect

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]


@pytest.fixture
def rig(faked: FakeRig) -> FakeRig:
    faked.begin_again()
    return faked


def test_rate_and_level_are_asked_for_by_sliders(page: Page, rig: FakeRig) -> None:
    picture = part(page, "reach").get_by_role("img")
    expect(picture).to_have_attribute(
        "aria-label",
        r"Rolls within reach: 2 to 55 Hz, level up to 1.00; now 23.1 Hz at level 0.28",
        timeout=PATIENCE_MS,
    )
    rate = page.get_by_role("slider", name="Rate of the roll")
    rate.focus()
    rate.press("ArrowRight")
    asked = wait_until(lambda: rig.rolls and rig.rolls[-1], "a request")
    assert asked["rate"] == pytest.approx(23.3, rel=0.02)
    wait_until(lambda: rig.value("k_hand") == asked["rate"], "its set")
    page.keyboard.press("Control+z")
    wait_until(lambda: rig.value("k_hand") == 20.0, "the step back")
    rate.focus()
    rate.press("End")
    expect(part(page, "roll")).to_contain_text("nearest: 55 Hz", timeout=PATIENCE_MS)
    level = page.get_by_role("slider", name="Level of the roll")
    level.focus()
    level.press("ArrowRight")
    assert wait_until(lambda: rig.rolls[-1].get("level"), "a level") == pytest.approx(0.285, abs=0.01)
