"""Cost of looking at the page: drumstick lab panel-cost [--seconds 12].

A whole rig plays its roll. The panel's and the sound server's CPU time, children included, are taken from the kernel
while nobody looks, while one browser (Chromium) looks at each view on a page too narrow for the picture, and at the
picture alone; the browser's own is not counted. Then the two
calls by which the audio thread shows its drum are timed alone, beside a block of the same drum at rest and ringing.
"""

import argparse
import os
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from browser import DESKTOP, NARROW, chromium, part, readback, visitor
from playwright.sync_api import Page, expect
from rig_process import Rig, running, wait_for

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.display_data import FRAMES_PER_S, request_display, show_sound, show_surface
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.measuring import stored
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import njit

VIEWS = ("Nothing", "Roll", "Orbit", "Return map", "Spectrum", "Cost", "Health")
PATIENCE_MS = 60_000.0
START_S, SETTLE_S = 20.0, 5.0
# A prediction is drawn: some number in the plot's first line.
_PREDICTED = """() => Object.values(window.__viserTestpoints.uplots).some(each =>
  each.chart.series[1].label.startsWith("predicted") &&
  Array.from(each.chart.data[1]).filter(Number.isFinite).length > 20)"""
BLOCK, RATE_HZ, CALLS, RUNS = 128, 48_000, 200_000, 7


def family(pid: int) -> list[int]:
    """A process and its children."""
    try:
        listed = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except FileNotFoundError:
        return []
    return [pid, *(member for child in listed for member in family(int(child)))]


def cpu_s(pid: int) -> float:
    """CPU seconds of a process and of its children so far."""
    ticks = 0
    for member in family(pid):
        fields = Path(f"/proc/{member}/stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def shares(rig: Rig, seconds: float) -> dict[str, float]:
    """Shares of a core that the panel and the sound server take."""
    pids = {name: rig.children()[name] for name in ("web_panel", "sound_server")}
    before, begun = {name: cpu_s(pid) for name, pid in pids.items()}, time.monotonic()
    time.sleep(seconds)
    spent = time.monotonic() - begun
    return {name: round((cpu_s(pid) - before[name]) / spent, 4) for name, pid in pids.items()}


def look_at(page: Page, view: str) -> None:
    page.get_by_role("button", name=view, exact=True).click()
    if view != "Nothing":
        expect(part(page, "view")).to_have_text(view, timeout=PATIENCE_MS)
    if view in ("Orbit", "Return map"):  # theory comes once for a set of values, from a process of its own
        page.wait_for_function(_PREDICTED, timeout=3 * PATIENCE_MS)
    if view == "Cost":  # measured once for a scene, in a process of its own
        expect(part(page, "tick-cost")).to_contain_text("all of it", timeout=3 * PATIENCE_MS)


def processes(seconds: float) -> dict[str, dict[str, float]]:
    rows: dict[str, dict[str, float]] = {}
    with running("up") as rig, chromium() as browser:
        found = wait_for("the panel's address", lambda: re.search(r"panel: (http\S+)", rig.said))
        rig.client().close()  # type: ignore[no-untyped-call]
        time.sleep(START_S)
        rows["nobody"] = shares(rig, seconds)
        context = visitor(browser, NARROW)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.goto(found[1])
        expect(readback(page, "dv_pls")).to_have_text("0.2m/s", timeout=PATIENCE_MS)
        for view in VIEWS:
            look_at(page, view)
            time.sleep(SETTLE_S)
            rows[view] = shares(rig, seconds)
            print(view, rows[view], flush=True)
        context.close()
        context = visitor(browser, DESKTOP)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.goto(found[1])
        look_at(page, "Nothing")
        time.sleep(SETTLE_S)
        rows["the picture"] = shares(rig, seconds)
        context.close()
        time.sleep(START_S)
        rows["nobody any more"] = shares(rig, seconds)
    return rows


@njit()
def _shown(engine: Engine, out: npt.NDArray[np.float32], calls: int) -> None:
    lent: Any = borrowed_view(engine)
    for _ in range(calls):
        show_surface(lent, out.shape[0])
        show_sound(lent, out)


def best_ns(work: Any, calls: int) -> float:
    """The quickest of seven runs, CPU time of this thread a call."""
    found: list[float] = []
    for _ in range(RUNS):
        begun = time.thread_time_ns()
        work()
        found.append((time.thread_time_ns() - begun) / calls)
    return round(min(found), 2)


def audio(scene: Scene) -> dict[str, float]:
    """ns a block of 128 frames."""
    ring = StrikeRing()
    engine = build(scene, RATE_HZ, ring)
    out = np.zeros((BLOCK, 2), np.float32)
    long = np.zeros((200 * BLOCK, 2), np.float32)
    _shown(engine, out, 1)
    render_all(engine, long, BLOCK, 0)
    found = {
        "a block at rest": best_ns(lambda: render_all(engine, long, BLOCK, 0), 200),
        "showing while nobody looks": best_ns(lambda: _shown(engine, out, CALLS), CALLS),
    }
    ring.push(0, 0.3, 0.0, 5.0, 0.005)
    found["a ringing block"] = best_ns(lambda: render_all(engine, long, BLOCK, 0), 200)
    request_display(engine.shown, surface=True, sound=False)
    found["showing the surface"] = best_ns(lambda: _shown(engine, out, CALLS), CALLS)
    request_display(engine.shown, surface=True, sound=True)
    found["showing surface and sound"] = best_ns(lambda: _shown(engine, out, CALLS), CALLS)
    blocks_a_copy = RATE_HZ / FRAMES_PER_S / BLOCK
    more = found["showing the surface"] - found["showing while nobody looks"]
    found["the block that copies a surface, more"] = round(more * blocks_a_copy, 1)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=12.0)
    seconds = parser.parse_args().seconds
    blocks = audio(parse(shipped_text("roll"), "roll"))
    print(blocks, flush=True)
    rows = processes(seconds)
    result = {
        "window_s": seconds,
        "block_frames": BLOCK,
        "audio_ns": blocks,
        "share_of_core": rows,
    }
    stored.store("panel_cost", result)


if __name__ == "__main__":
    main()
