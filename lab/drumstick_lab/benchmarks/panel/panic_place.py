"""Place of PANIC on the page, through all states, sizes and zooms: drumstick lab panic-place [--pictures DIR] [--sizes SIZE ...].

A whole rig and a page in Chromium go through the states of panic_states, each made by a real event: keys and clicks on
the page, another client, `drumstick arm`, a stopped or killed service. The states are made at one size after the other,
and every frame is watched while they come about; then the state is looked at in all six, and at three zooms of a desktop's
window. Stored: every box that PANIC had at each
size, which should be one, in which states something covered its middle, and in which it took no clicks, since viser
takes none while it has no connection; and for how long, at most, the page did not say so. Left out: the frames of the change of size
itself, until the panel has heard of it, so a panel that hangs is looked at in one size; and the picture, which is drawn without a graphics card here, is out of view at all sizes, as it is on a phone.

--pictures: also a picture of each state at each size, and for each size one sheet of them all. --sizes: only these, such
as 1280x800, and nothing is stored.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from browser import DESKTOP, NARROW, NO_PICTURE, PHONE, part
from playwright.sync_api import CDPSession, Page

from drumstick_lab.benchmarks.panel.panic_stage import playing
from drumstick_lab.benchmarks.panel.panic_states import STATES, Step
from drumstick_lab.benchmarks.panel.state_pictures import StatePictures
from drumstick_lab.measuring import stored

ALL = (Step("playing", lambda _: None), *STATES)
Boxes = dict[str, dict[str, list[str]]]  # by size, by box: the states that had it
_NAMED = 10
SIZES = (PHONE, NARROW, DESKTOP, (360, 640), (820, 1180), (1920, 1080))
# A desktop's window at a browser's zoom in %: so many dots of the page in width and height, and its dots' scale.
ZOOMED = {
    (round(100 * DESKTOP[0] / zoom), round(100 * DESKTOP[1] / zoom)): zoom / 100 for zoom in (80, 125, 200)
}
EVERY_SIZE = {f"{width}x{height}": (width, height) for width, height in (*SIZES, *ZOOMED)}
# Each frame: PANIC's box and what its middle meets, kept when another one; not before three frames alike after a change
# of the window's size.
_WATCH = """() => {
  const button = () => [...document.querySelectorAll('button')].find(each => each.innerText.startsWith('PANIC'));
  window.places = {};
  window.frames = 0;
  window.unsaid = 0;
  let deafSince = null;
  let size = '', last = '', alike = 0, heard = false;
  const isHeard = () => {
    const room = innerWidth <= 576 ? 'phone' : innerWidth <= 800 ? 'tablet' : innerWidth < 1500 ? 'desk' : 'wide';
    return document.querySelector('[data-room]')?.dataset.room === room;
  };
  const look = () => {
    const now = `${innerWidth}x${innerHeight}`, found = button();
    let place = 'gone', met = '';
    if (found) {
      const box = found.getBoundingClientRect();
      place = [box.x, box.y, box.width, box.height].map(each => Math.round(10 * each) / 10).join(' ');
      const top = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
      met = getComputedStyle(found).pointerEvents === 'none' ? 'deaf' : found.contains(top) ? '' : 'covered';
    }
    const time = performance.now(), isUnsaid = met === 'deaf' && !document.querySelector('[data-part="cut-off"]');
    deafSince = isUnsaid ? deafSince ?? time : null;
    window.unsaid = Math.max(window.unsaid, isUnsaid ? time - deafSince : 0);
    alike = now === size && place === last ? alike + 1 : now === size && alike >= 3 ? 3 : 0;
    if (size !== now) heard = false;
    heard ||= isHeard();
    if (!heard) alike = 0;
    size = now; last = place;
    if (alike >= 3) {
      const seen = (window.places[size] ??= {});
      seen[place] = (seen[place] ?? 0) + 1;
      if (met) seen[met] = (seen[met] ?? 0) + 1;
    }
    window.frames += alike >= 3;
    requestAnimationFrame(look);
  };
  look();
}"""
_TAKE = "() => { const found = window.places; window.places = {}; return found; }"
_STAY = """more => new Promise(done => {
  const from = window.frames;
  const look = () => window.frames >= from + more ? done() : requestAnimationFrame(look);
  look();
})"""
_FRAMES = 2


def hears(page: Page) -> bool:
    """True when the panel would hear of another size."""
    return part(page, "cut-off").count() == 0


def stand(page: Page, chrome: CDPSession, size: tuple[int, int]) -> None:
    """Give the window this size, at its zoom, and wait until some frames were drawn so."""
    metrics = {
        "width": size[0],
        "height": size[1],
        "deviceScaleFactor": ZOOMED.get(size, 1.0),
        "mobile": False,
    }
    chrome.send("Emulation.setDeviceMetricsOverride", metrics)
    page.evaluate(_STAY, _FRAMES)


def result_of(
    boxes: Boxes, not_met: dict[str, dict[str, list[str]]], unsaid_ms: float, states: int
) -> dict[str, Any]:
    """Stored form: boxes by size with the number of states that had them, named where these are few."""
    return {
        "states": states,
        "of_states": len(ALL),
        "boxes": {
            size: [
                {"box": box, "states": len(named), "named": named if len(named) <= _NAMED else []}
                for box, named in of_size.items()
            ]
            for size, of_size in boxes.items()
        },
        "zoom": {f"{width}x{height}": scale for (width, height), scale in ZOOMED.items()},
        "covered_in": not_met["covered"],
        "deaf_in": not_met["deaf"],
        "deaf_unsaid_ms": unsaid_ms,
    }


def measured(
    store: Callable[[dict[str, Any]], object],
    sizes: Sequence[tuple[int, int]],
    pictures: StatePictures | None,
) -> dict[str, Any]:
    """Go through all states; what was found so far is stored after each, so that one that does not come loses none."""
    boxes: Boxes = {f"{width}x{height}": {} for width, height in sizes}
    not_met: dict[str, dict[str, list[str]]] = {"covered": {}, "deaf": {}}
    unsaid_ms = 0.0
    with tempfile.TemporaryDirectory() as folder, playing() as stage:
        stage.kept["folder"] = folder
        stage.page.add_style_tag(content=NO_PICTURE)
        # One session for all sizes: the browser forgets what a session asked for when it ends.
        chrome = stage.page.context.new_cdp_session(stage.page)
        stage.page.evaluate(_WATCH)
        size = sizes[0]
        stand(stage.page, chrome, size)
        stage.page.evaluate(_TAKE)
        for number, (words, make, seen_at) in enumerate(ALL):
            begun = time.monotonic()
            if hears(stage.page):
                size = sizes[number % len(sizes)]
                stand(stage.page, chrome, size)
            make(stage)
            is_heard = hears(stage.page)
            for each in sizes if is_heard else (size,):
                if is_heard:
                    stand(stage.page, chrome, each)
                size = each
                if pictures is not None:
                    pictures.take(stage.page, chrome, size, words, seen_at)
            for named, found in stage.page.evaluate(_TAKE).items():
                for why, states in not_met.items():
                    if found.pop(why, 0):
                        states.setdefault(words, []).append(named)
                for box in found:
                    boxes[named].setdefault(box, []).append(words)
            unsaid_ms = stage.page.evaluate("window.unsaid")
            store(result_of(boxes, not_met, unsaid_ms, number + 1))
            print(f"{words}: {time.monotonic() - begun:.1f} s", flush=True)
    return result_of(boxes, not_met, unsaid_ms, len(ALL))


def main() -> None:
    """Measure, tell and store."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--pictures", type=Path, metavar="DIR", help="a picture of each state, and sheets of them"
    )
    parser.add_argument(
        "--sizes",
        nargs="+",
        choices=EVERY_SIZE,
        metavar="SIZE",
        help=f"of {', '.join(EVERY_SIZE)}; stores nothing",
    )
    given = parser.parse_args()
    pictures = None if given.pictures is None else StatePictures(given.pictures)
    sizes = [EVERY_SIZE[name] for name in given.sizes or EVERY_SIZE]
    try:
        result = measured(lambda found: given.sizes or stored.store("panic_place", found), sizes, pictures)
    finally:  # a state that does not come is what one wants to see
        for path in [] if pictures is None else pictures.sheets():
            print(path)
    for size, rows in result["boxes"].items():
        print(size, rows)
    print("covered:", result["covered_in"], "deaf:", result["deaf_in"], result["deaf_unsaid_ms"], "ms")


if __name__ == "__main__":
    main()
