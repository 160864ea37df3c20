"""The page before, without, and after the rig."""

import os
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path

import pytest
from browser import NARROW, PATIENCE_MS, note, part, readback, see, slider, visitor
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess, panel
from playwright.sync_api import Browser, Page, expect

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text

pytestmark = [pytest.mark.system, pytest.mark.needs("chromium")]
BARE = 'name = "bare"\n[stick]\nk_coll_N_per_m = 4000.0\n'


def scene(name: str) -> Scene:
    return parse(shipped_text(name), f"{name}.toml")


@pytest.fixture
def port(free_port: Callable[[], int]) -> int:
    """The router's."""
    return free_port()


@pytest.fixture
def served(port: int, tmp_path: Path, free_port: Callable[[], int]) -> Iterator[PanelProcess]:
    with panel(f"tcp/127.0.0.1:{port}", free_port(), tmp_path / "token") as running:
        yield running
        assert running.stop() == 0
        assert running.further_lines() == []


@pytest.fixture
def page(browser: Browser, served: PanelProcess) -> Iterator[Page]:
    context = visitor(browser, NARROW)
    opened = context.new_page()
    opened.goto(served.address)
    yield opened
    context.close()


@pytest.mark.long
def test_it_is_there_before_the_rig_and_outlives_it(page: Page, port: int) -> None:
    see(page, "notice", "Waiting for the haptic server")
    see(page, "absent", "The controls appear")
    first = FakeRig(scene("roll"), port=port, boot=1)
    see(page, "notice", "Playing")
    expect(readback(page, "k_coll")).to_have_text("5000N/m", timeout=PATIENCE_MS)
    first.set_elsewhere("k_coll", 7000.0)
    expect(readback(page, "k_coll")).to_have_text("7000N/m", timeout=PATIENCE_MS)
    first.close()
    see(page, "notice", re.compile(r"No data from the haptic server for [1-9]\d* s"))

    # Another start, with revisions counted from 0 again, and a scene without the pulse.
    second = FakeRig(parse(BARE, "bare.toml"), port=port, boot=2)
    see(page, "notice", "Playing")
    expect(readback(page, "k_coll")).to_have_text("4000N/m", timeout=PATIENCE_MS)
    expect(readback(page, "dv_pls")).to_have_count(0, timeout=PATIENCE_MS)
    expect(page.locator("[role=slider]")).to_have_count(len(second.table), timeout=PATIENCE_MS)
    thumb = slider(page, "k_coll")
    thumb.focus()
    thumb.press("ArrowRight")
    wait_until(lambda: second.sets, "a set query to the second rig")
    second.close()


@pytest.mark.long
def test_a_silent_haptic_server_is_told_from_a_missing_router(page: Page, port: int) -> None:
    rig = FakeRig(scene("roll"), port=port)
    see(page, "notice", "Playing")
    rig.mute(True)
    see(page, "notice", "No data from the haptic server")
    rig.status = "fault: NaN from the device"
    rig.mute(False)
    see(page, "notice", "Fault: NaN from the device")
    rig.close()


@pytest.mark.long
def test_a_readback_missed_on_the_way_is_asked_for(page: Page, port: int) -> None:
    rig = FakeRig(scene("roll"), port=port)
    expect(readback(page, "k_coll")).to_have_text("5000N/m", timeout=PATIENCE_MS)
    rig.lose("k_coll", 6000.0)
    expect(readback(page, "k_coll")).to_have_text("6000N/m", timeout=PATIENCE_MS)
    rig.latching = rig.losing = True
    rig.set_elsewhere("k_coll", 7000.0)
    expect(note(page, "k_coll")).to_have_text("waits until the stick is above the head", timeout=PATIENCE_MS)
    rig.latch()
    expect(readback(page, "k_coll")).to_have_text("7000N/m", timeout=PATIENCE_MS)
    rig.close()


def kill_what_computes(panel_pid: int) -> None:
    for children in Path(f"/proc/{panel_pid}/task").glob("*/children"):
        with suppress(FileNotFoundError, ProcessLookupError):  # a thread, or a process, that has just ended
            for child in children.read_text().split():
                os.kill(int(child), signal.SIGKILL)


@pytest.mark.long
def test_predictions_come_back_after_the_processes_that_compute_were_killed(
    page: Page, served: PanelProcess, port: int
) -> None:
    """As the kernel kills them, first of all, where memory ends. Nobody moves a value afterwards."""
    with closing(FakeRig(scene("roll"), port=port)) as rig:
        see(page, "notice", "Playing")
        page.get_by_role("button", name="Orbit", exact=True).click()
        lost = {"prediction": "No prediction: the process", "missing": "No prediction here: the process"}

        def all_lost() -> bool:
            kill_what_computes(served.process.pid)
            told = {name: " ".join(part(page, name).all_inner_texts()) for name in lost}
            return all(told[name].startswith(words) for name, words in lost.items())

        rig.set_elsewhere("k_coll", 6000.0)  # whatever was known is asked for anew
        wait_until(all_lost, "words about what was lost")
        expect(part(page, "missing")).to_have_count(0, timeout=PATIENCE_MS)
        expect(part(page, "prediction")).to_contain_text("stable", timeout=PATIENCE_MS)
        # Below the picture of rate and level.
        expect(page.get_by_text(re.compile("now .* Hz at level"))).to_be_attached(timeout=PATIENCE_MS)
