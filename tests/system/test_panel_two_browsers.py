"""Two technicians at one panel, each with a browser, against a fake haptic side."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import PATIENCE_MS, opened, page_at, part, readback
from fake_rig import FakeRig, free_port, wait_until
from panel_process import panel
from playwright.sync_api import Browser, Page, expect

from drumstick.scenes.scene_text import parse, shipped_text

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]


@pytest.fixture
def rig() -> Iterator[FakeRig]:
    made = FakeRig(parse(shipped_text("roll"), "roll.toml"))
    made.presets = {"slow": {"dv_pls": 0.1}, "fast": {"dv_pls": 0.3}}
    yield made
    made.close()


@pytest.fixture
def pages(browser: Browser, rig: FakeRig, tmp_path: Path) -> Iterator[tuple[Page, Page]]:
    with (
        panel(rig.endpoint, free_port(), tmp_path / "token") as served,
        page_at(browser, served.address, PATIENCE_MS) as ada,
        page_at(browser, served.address, PATIENCE_MS) as bob,
    ):
        yield ada, bob


def press(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


@pytest.mark.long
def test_a_button_does_nothing_with_what_somebody_else_has_chosen(
    pages: tuple[Page, Page], rig: FakeRig
) -> None:
    ada, bob = pages
    for page in pages:
        opened(page, "More")
        opened(page, "Presets")
    press(ada, "k_coll")
    expect(part(bob, "exact")).to_contain_text("k_coll: 1", timeout=PATIENCE_MS)  # heard before his
    press(bob, "dv_pls")
    expect(part(ada, "exact")).to_contain_text("dv_pls: 0", timeout=PATIENCE_MS)
    ada.get_by_role("textbox", name="Value", exact=True).fill("0.9")
    press(ada, "Set")
    expect(part(ada, "exact")).to_contain_text("dv_pls was chosen in another browser", timeout=PATIENCE_MS)
    assert rig.sets == []
    press(ada, "dv_pls")
    expect(part(ada, "exact")).to_contain_text("dv_pls: 0", timeout=PATIENCE_MS)
    press(ada, "Set")
    wait_until(lambda: rig.sets == [("dv_pls", 0.9)], "the value")

    press(ada, "slow")
    expect(part(bob, "preset")).to_contain_text("slow: chosen", timeout=PATIENCE_MS)
    press(bob, "fast")
    expect(part(ada, "preset")).to_contain_text("fast: chosen", timeout=PATIENCE_MS)
    press(ada, "Load preset")
    expect(part(ada, "preset")).to_contain_text("fast was chosen in another browser", timeout=PATIENCE_MS)
    press(bob, "Load preset")
    expect(readback(ada, "dv_pls")).to_have_text("0.3m/s", timeout=PATIENCE_MS)
