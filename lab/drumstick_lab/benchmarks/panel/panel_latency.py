"""From a slider on the technician's page to a changed force: drumstick lab panel-latency [--moves 40].

The real rig (servo, gateway, sound on a null device, panel) and a real browser. A key moves the focused slider of
K_coll by one step, 2.3 %; it counts from before the key is pressed until the begin of the first contact whose peak
force is another, by the servo's clock. What must pass in between, and is part of it: the stick is above the head, and
comes down again. Also: until the servo uses the value (its readback on the wire, asked by nobody), until the page shows
it, and until the page shows what is computed of it. On a desktop, whose picture of the drum Chromium draws without a
graphics card here, and on a phone, which shows none. And the processor that the panel takes and what computes for it:
nobody looking, one browser looking, one browser dragging. And what of a newcomer's time is the machine's: from the
printed address, in a browser that was never here, until the page shows the roll; from there, twelve steps to the left
on the first slider, until it shows a faster one.
"""

import argparse
import os
import re
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from browser import DESKTOP, PHONE, chromium, part, readback, slider, visitor
from playwright.sync_api import Browser, Page, expect
from rig_process import Listener, Rig, ask, running, wait_for

from drumstick_lab.measuring import stored
from protocol.messages import Release, Strike

GOAL_MS = 150.0
CHANGED = 2e-3  # of the peak force: a step changes it by 1 %, a settled roll by 1e-6
SETTLES_S = 1.2  # the roll, after a step
LOOKS_S = 12.0
PATIENCE_MS = 120_000.0


def address(rig: Rig) -> str | None:
    """Address that the panel printed."""
    return next((line.split("panel: ")[1] for line in rig.lines if "panel: http" in line), None)


class Heard:
    """Messages of the rig, and when they came here (monotonic ns)."""

    def __init__(self, session: Any, rig: Rig) -> None:
        self.strikes = Listener(session, rig.keys.strike, Strike)
        self.releases = Listener(session, rig.keys.release, Release)
        self.used_ns: list[int] = []
        self._subscriber = session.declare_subscriber(
            rig.keys.param("k_coll"), lambda sample: self.used_ns.append(time.monotonic_ns())
        )

    def contact_changed_ns(self, since_ns: int, before_N: float) -> int | None:
        """Begin of the first contact after `since_ns` whose peak differs."""
        begun = {strike.seq: strike.t_ns for strike in self.strikes.got[-200:]}
        for release in self.releases.got[-200:]:
            at = begun.get(release.seq)
            if at is not None and at > since_ns and abs(release.peak_N / before_N - 1.0) > CHANGED:
                return at
        return None


def moves(page: Page, heard: Heard, count: int) -> dict[str, list[float]]:
    """Milliseconds of each move, in turn; every other one goes back."""
    thumb = slider(page, "k_coll")
    thumb.focus()
    found: dict[str, list[float]] = {"force": [], "used": [], "shown": [], "foreseen": []}
    for move in range(count):
        time.sleep(SETTLES_S)
        before_N = heard.releases.got[-1].peak_N
        used_before = len(heard.used_ns)
        # In the page, frame by frame: when the readback is another, and when the prediction is that of the value under
        # the thumb and stays so. It names the values that the servo does not use yet: at first the new one, or, when
        # the servo was quicker, the old one.
        page.evaluate(
            """() => {
                 const text = name => document.querySelector(name)?.textContent;
                 const readback = () => text('[data-param=k_coll] [data-part=readback]');
                 const thumb = document.activeElement, STAYS_MS = 300;
                 const isOwn = () => {
                   const value = Number((10 ** Number(thumb.getAttribute('aria-valuenow'))).toPrecision(3));
                   const words = text('[data-part=prediction]') ?? '';
                   return words.startsWith(`Predicted with K_coll ${value} N/m:`) ||
                     (words.startsWith('Predicted:') && readback() !== before);
                 };
                 const before = readback();
                 let begun = null, own = null;
                 window.seen = {};
                 document.addEventListener('keydown', e => { begun = performance.now(); }, {once: true});
                 const look = () => {
                   const now = performance.now();
                   if (begun !== null) {
                     if (readback() !== before) window.seen.shown ??= now - begun;
                     own = isOwn() ? own ?? now : null;
                     if (own !== null && now - own > STAYS_MS) window.seen.foreseen ??= own - begun;
                   }
                   if (Object.keys(window.seen).length < 2) requestAnimationFrame(look);
                 };
                 look();
               }"""
        )
        begin_ns = time.monotonic_ns()
        page.keyboard.press("ArrowRight" if move % 2 == 0 else "ArrowLeft")
        wait_for("the readback", lambda n=used_before: len(heard.used_ns) > n, 20.0)
        at_ns = wait_for("another force", lambda b=begin_ns, n=before_N: heard.contact_changed_ns(b, n), 20.0)
        page.wait_for_function("() => Object.keys(window.seen).length === 2", timeout=20_000)
        found["force"].append((at_ns - begin_ns) * 1e-6)
        found["used"].append((heard.used_ns[used_before] - begin_ns) * 1e-6)
        for name, late in page.evaluate("() => window.seen").items():
            found[name].append(late)
    return found


def spent_s(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident(pid: int) -> float:
    """Memory of a process that is its own or shared, now, MB."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def children(pid: int) -> list[int]:
    """Children of every thread: who started them need not be the main one."""
    return [
        int(c)
        for task in Path(f"/proc/{pid}/task").iterdir()
        for c in (task / "children").read_text().split()
    ]


def shares(pids: dict[str, int], play: Callable[[float], None]) -> dict[str, float]:
    """Share of a core that each process takes while `play` goes on for LOOKS_S."""
    before, begin = {name: spent_s(pid) for name, pid in pids.items()}, time.monotonic()
    play(LOOKS_S)
    took_s = time.monotonic() - begin
    return {name: (spent_s(pid) - before[name]) / took_s for name, pid in pids.items()}


def dragging(page: Page) -> Callable[[float], None]:
    """Drag to and fro, sixty times a second."""

    def drag(seconds: float) -> None:
        box = slider(page, "dv_pls").bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            page.mouse.move(x + 60.0 * np.sin(2.0 * time.monotonic()), y)
            time.sleep(1.0 / 60.0)
        page.mouse.up()

    return drag


def newcomer(browser: Browser, where: str) -> dict[str, float]:
    """Seconds until the page shows the roll, and then until it shows a faster one."""
    page = visitor(browser, DESKTOP).new_page()
    begin = time.monotonic()
    page.goto(where)
    rate = part(page, "roll-rate")
    expect(rate).to_contain_text(re.compile(r"2[23]\.\d"), timeout=PATIENCE_MS)
    seen = time.monotonic()
    first = page.get_by_role("slider").first
    first.focus()
    for _ in range(12):
        first.press("ArrowLeft")
    expect(rate).to_contain_text(re.compile(r"(2[6-9]|3\d)\.\d"), timeout=PATIENCE_MS)
    faster = time.monotonic()
    page.context.close()
    return {"roll_on_the_page": seen - begin, "faster_roll_on_the_page": faster - seen}


def one_prediction() -> dict[str, float]:
    """Milliseconds that a prediction takes for one set of values, its process and pipes left out."""
    from drumstick.scenes.scene_text import parse, shipped_text
    from web_panel.computing.predicted_roll import predicted_roll

    roll = parse(shipped_text("roll"), "roll")
    predicted_roll(roll, {}, {})
    took_ms: list[float] = []
    for value in np.linspace(0.05, 1.0, 200):
        begin = time.process_time_ns()
        predicted_roll(roll, {"dv_pls": float(value)}, {})
        took_ms.append((time.process_time_ns() - begin) * 1e-6)
    return {"p50": statistics.median(took_ms), "max": max(took_ms), "values": len(took_ms)}


def percentiles(times_ms: list[float]) -> dict[str, float]:
    """p50, p90 and the longest."""
    return {
        "p50": statistics.median(times_ms),
        "p90": float(np.percentile(times_ms, 90)),
        "max": max(times_ms),
    }


def measured(count: int) -> dict[str, Any]:
    """Everything, on a rig of its own."""
    with running("up", "--scene", "roll") as rig, chromium() as browser:
        where = wait_for("the panel's address", lambda: address(rig), 180.0)
        session = rig.client()
        heard = Heard(session, rig)
        wait_for("strikes", lambda: len(heard.releases.got) > 20)
        pids = {"panel": rig.children()["web_panel"]}
        alone = shares(pids, time.sleep)
        new_here = newcomer(browser, where)
        ask(session, rig.keys.set_many, {"dv_pls": 0.2})
        page = visitor(browser, DESKTOP).new_page()
        page.goto(where)
        expect(readback(page, "k_coll")).to_have_text("5000N/m", timeout=PATIENCE_MS)
        expect(part(page, "prediction")).to_contain_text("Predicted:", timeout=PATIENCE_MS)
        pids["computing"] = children(pids["panel"])[0]
        looking = shares(pids, time.sleep)
        times = {"desktop": moves(page, heard, count)}
        drawn = shares(pids, dragging(page))
        page.context.close()
        ask(session, rig.keys.set_many, {"dv_pls": 0.2})
        page = visitor(browser, PHONE).new_page()
        page.goto(where)
        expect(part(page, "prediction")).to_contain_text("Predicted:", timeout=PATIENCE_MS)
        times["phone"] = moves(page, heard, count)
        memory = {name: resident(pid) for name, pid in pids.items()}
        ask(session, rig.keys.set_many, {"k_coll": 5000.0})
        session.close()
    return {
        "moves": count,
        "goal_ms": GOAL_MS,
        "rows_ms": {
            size: {name: percentiles(row) for name, row in found.items()} for size, found in times.items()
        },
        # Of so many moves the prediction was drawn no later than the readback, and than the force was another.
        "foreseen_first": {
            size: {
                than: sum(f <= t for f, t in zip(found["foreseen"], found[than], strict=True))
                for than in ("shown", "force")
            }
            for size, found in times.items()
        },
        "newcomer_s": new_here,
        "share_of_core": {"nobody": alone, "one browser": looking, "one browser drags": drawn},
        "resident_MB": memory,
        "one_prediction_ms": one_prediction(),
    }


def main() -> None:
    """Measure, tell and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moves", type=int, default=40)
    found = measured(parser.parse_args().moves)
    for size, rows in found["rows_ms"].items():
        for name, row in rows.items():
            print(f"{size} {name:9s} " + ", ".join(f"{at} {value:.0f}" for at, value in row.items()) + " ms")
        if rows["force"]["p50"] > GOAL_MS:
            print(f"{size}: above the goal: p50 {GOAL_MS:.0f} ms")
    for name, row in found["share_of_core"].items():
        print(f"{name:18s} " + ", ".join(f"{which} {share:.1%}" for which, share in row.items()))
    print("newcomer " + ", ".join(f"{name} {took:.1f} s" for name, took in found["newcomer_s"].items()))
    stored.store("panel_latency", found)


if __name__ == "__main__":
    main()
