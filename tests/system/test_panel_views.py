"""Views of the page, in a real browser, against a fake haptic side; one page for all."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from browser import DESKTOP, NARROW, PATIENCE_MS, part, visitor
from fake_rig import FakeRig, free_port, wait_until
from panel_process import PanelProcess, panel
from playwright.sync_api import Browser, Page, expect
from rig_process import leave

from drumstick.scenes.scene_text import parse, shipped_text

pytestmark = [
    pytest.mark.system,
    pytest.mark.needs("chromium"),
    pytest.mark.timeout(
        900
    ),  # more than the patience of one test's waits; the usual one would end pytest as a whole
]
COMPILING_S = 180.0  # the first theory and the first timed tick compile their kernels
# What the page tells by its buttons is lost, until it is heard again; how often.
_LOSE = """() => {
  const told = window.__viserMutable.sendMessage;
  window.lost = 0;
  window.__viserMutable.sendMessage = (message) => {
    if (message.type !== "GuiUpdateMessage") told(message);
    else window.lost += 1;
  };
  window.hear = () => { window.__viserMutable.sendMessage = told; };
}"""
# What a plot of uPlot's holds, and its labels; the page has one plot or two at a time.
_DATA = """() => Object.values(window.__viserTestpoints.uplots).map(each => ({
  labels: each.chart.series.map(series => series.label), data: each.chart.data.map(column => Array.from(column))
}))"""


@pytest.fixture(scope="module")
def rig() -> Iterator[FakeRig]:
    made = FakeRig(parse(shipped_text("roll"), "roll.toml"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def own_accuracy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("own") / "accuracy.json"


@pytest.fixture(scope="module")
def served(
    rig: FakeRig, tmp_path_factory: pytest.TempPathFactory, own_accuracy: Path
) -> Iterator[PanelProcess]:
    folder = tmp_path_factory.mktemp("panel")
    shipped = folder / "shipped.json"
    shipped.write_text(accuracy_result("a fast machine", 100.0))
    files = {"accuracy_shipped": shipped, "accuracy_own": own_accuracy}
    with panel(rig.endpoint, free_port(), folder / "token", "main", **files) as running:
        yield running


def accuracy_result(processor: str, ns: float) -> str:
    """As `drumstick accuracy` stores it, with a point of each kind."""
    mesh = {"ns_per_sample": ns, "rms_cents": 2.0}
    stick = {"ns_per_s": 1e3 * ns, "error_contacts": 1e-6}
    machine = {"processor": processor, "date": "2026-01-01", "quick": True}
    return json.dumps({"machine": machine, "mesh": {"rows": [mesh]}, "stick": {"rows": [stick]}})


def look_at(page: Page, view: str) -> None:
    page.get_by_role("button", name=view, exact=True).click()
    expect(part(page, "view")).to_have_text(view, timeout=PATIENCE_MS)


def plotted(page: Page, label: str, good: Callable[[list[float | None]], bool]) -> list[float | None]:
    """The column of this label in some plot on the page, once it is as it should be."""

    def found() -> list[float | None] | None:
        for plot in page.evaluate(_DATA):
            if label in plot["labels"]:
                column = plot["data"][plot["labels"].index(label)]
                if good(column):
                    return column
        return None

    return wait_until(found, f"{label} in a plot", COMPILING_S)


def there(column: list[float | None]) -> list[float]:
    return [value for value in column if value is not None and value == value]


@pytest.mark.long
def test_nothing_is_asked_for_before_anybody_looks(rig: FakeRig, served: PanelProcess) -> None:
    wait_until(lambda: rig.strikes > 60, "two seconds")
    assert rig.watched() == set()


def test_the_roll_is_traced(page: Page, rig: FakeRig) -> None:
    look_at(page, "Roll")
    for label, value in (
        ("roll rate, Hz", 23.05),
        ("v_E, m/s", 0.628),
        ("contact time, ms", 5.5),
        ("largest force, N", 5.4),
    ):
        column = plotted(page, label, lambda column: len(column) > 20)
        assert there(column)[-1] == pytest.approx(value)
    assert there(plotted(page, "strike speed, m/s", lambda column: len(there(column)) > 5))[-1] > 0.0
    wait_until(lambda: rig.watched() == {"strike", "release"}, "nobody who wants the membrane")


def test_strikes_lie_on_the_curve_of_their_levels(page: Page, rig: FakeRig) -> None:
    look_at(page, "Level")
    struck = plotted(page, "strikes, last 10 s", lambda column: len(there(column)) > 5)
    assert set(there(struck)) == {0.31}
    line = there(plotted(page, "level of a strike", lambda column: len(there(column)) > 20))
    assert (min(line), max(line)) == (0.0, 1.0)
    wait_until(lambda: rig.watched() == {"strike"}, "nobody who wants releases")


@pytest.mark.long
def test_the_orbit_has_what_was_played_the_cycle_and_the_section(page: Page, rig: FakeRig) -> None:
    look_at(page, "Orbit")
    played = plotted(page, "played, last 3 s", lambda column: len(there(column)) > 20)
    assert set(there(played)) == {0.1}
    rising = plotted(page, "predicted, rising", lambda column: len(there(column)) > 20)
    # Less than v_E, 0.628 m/s: the hand slows the stick while the pulse still pushes.
    assert max(there(rising)) == pytest.approx(0.494, abs=0.01)
    assert len(there(plotted(page, "section E", lambda column: len(there(column)) > 1))) == 2
    wait_until(lambda: rig.watched() == {"strike"}, "nobody who wants releases")


@pytest.mark.long
def test_the_return_map_crosses_the_diagonal_at_the_predicted_roll(page: Page) -> None:
    look_at(page, "Return map")
    fixed = there(plotted(page, "predicted roll", lambda column: len(there(column)) == 1))
    assert fixed == pytest.approx([0.628], abs=1e-3)
    assert there(plotted(page, "played, last 10 s", lambda column: len(there(column)) > 5))[
        0
    ] == pytest.approx(0.628)


@pytest.mark.long
def test_another_value_gives_another_prediction(page: Page, rig: FakeRig) -> None:
    look_at(page, "Return map")
    rig.set_elsewhere("dv_pls", 0.4)
    fixed = plotted(page, "predicted roll", lambda column: there(column) and there(column)[0] > 0.8)
    assert len(there(fixed)) == 1
    rig.set_elsewhere("dv_pls", 0.2)


@pytest.mark.long
def test_the_spectrum_is_drawn_and_the_ideal_modes_are_marked(page: Page, rig: FakeRig) -> None:
    look_at(page, "Spectrum")
    heard = plotted(page, "heard", lambda column: max(there(column), default=-100.0) > -13.0)
    assert min(there(heard)) == pytest.approx(-80.0)
    modes = plotted(page, "ideal membrane’s modes", lambda column: bool(there(column)))
    assert sum(value == 0.0 for value in there(modes)) == 20 + 1  # the dot at f01 has a place of its own
    assert "spectrum" in rig.watched()
    rig.sounding = False
    expect(part(page, "missing")).to_have_text("No sound server reports a spectrum.", timeout=PATIENCE_MS)
    plotted(page, "heard", lambda column: not there(column))
    rig.sounding = True
    plotted(page, "heard", lambda column: bool(there(column)))
    expect(part(page, "missing")).to_have_count(0, timeout=PATIENCE_MS)


@pytest.mark.long
def test_this_machines_accuracy_is_shown_beside_the_packages(page: Page, own_accuracy: Path) -> None:
    own_accuracy.unlink(missing_ok=True)
    look_at(page, "Accuracy")
    expect(part(page, "accuracy").last).to_contain_text("drumstick accuracy --quick", timeout=PATIENCE_MS)
    assert there(plotted(page, "measured for this version", lambda column: bool(there(column)))) == [2.0]
    leave(own_accuracy, accuracy_result("a slow one", 300.0))
    assert there(plotted(page, "this machine", lambda column: bool(there(column)))) == [2.0]
    expect(part(page, "accuracy").last).to_contain_text("a slow one", timeout=PATIENCE_MS)
    expect(part(page, "accuracy").first).to_contain_text("a fast machine", timeout=PATIENCE_MS)


@pytest.mark.long
def test_the_cost_of_a_finer_mesh_is_told(page: Page) -> None:
    look_at(page, "Cost")
    expect(part(page, "drum-cost")).to_contain_text(
        re.compile(r"fine.*about 84 %.*0\.4 cents"), timeout=PATIENCE_MS
    )
    expect(part(page, "tick-cost")).to_contain_text(
        re.compile(r"of that pulse\s*−?-?\d+ ns"), timeout=1e3 * COMPILING_S
    )


def test_health_tells_who_is_there_and_how_late_the_ticks_are(page: Page, rig: FakeRig) -> None:
    look_at(page, "Health")
    expect(part(page, "present")).to_have_text(
        "Connected: 1 panel; 1 browser on this page.", timeout=PATIENCE_MS
    )
    expect(part(page, "network")).to_contain_text("null")
    expect(part(page, "announced")).to_contain_text(
        "peak force announced +0.0 dB (worst +0.0 dB), impulse +0.0 dB", timeout=PATIENCE_MS
    )
    assert "release" in rig.watched()
    late = plotted(page, "lateness histogram", lambda column: len(column) == 4)
    assert there(late) == [8e7, 700.0, 3.0]  # of a day


@pytest.mark.long
def test_another_browser_looks_at_what_it_likes(
    page: Page, browser: Browser, rig: FakeRig, served: PanelProcess
) -> None:
    look_at(page, "Health")
    with closing(visitor(browser, NARROW)) as context:
        other = context.new_page()
        other.goto(served.address)
        expect(part(other, "view")).to_have_text("Roll", timeout=PATIENCE_MS)
        other.get_by_role("button", name="Nothing", exact=True).click()
        expect(part(other, "view")).to_have_count(0, timeout=PATIENCE_MS)
        expect(part(page, "view")).to_have_text("Health")
        expect(part(page, "present")).to_contain_text("2 browsers", timeout=PATIENCE_MS)
    expect(part(page, "present")).to_contain_text("1 browser on", timeout=PATIENCE_MS)


@pytest.mark.long
def test_the_membrane_is_asked_for_while_a_page_has_room_for_it(
    page: Page, browser: Browser, served: PanelProcess, rig: FakeRig
) -> None:
    """A narrow page hides the picture: nobody is asked for it, until the page grows, and again when it shrinks."""
    look_at(page, "Spectrum")
    wait_until(lambda: rig.watched() == {"strike", "spectrum"}, "somebody who wants the spectrum")
    with closing(visitor(browser, DESKTOP)) as context:
        wide = context.new_page()
        wide.goto(served.address)
        wait_until(lambda: "membrane" in rig.watched(), "somebody who wants the membrane", COMPILING_S)
        wide.set_viewport_size({"width": NARROW[0], "height": NARROW[1]})
        wait_until(lambda: "membrane" not in rig.watched(), "a page that got narrow", COMPILING_S)
        wide.set_viewport_size({"width": DESKTOP[0], "height": DESKTOP[1]})
        wait_until(lambda: "membrane" in rig.watched(), "a page that got wide again", COMPILING_S)
        wide.evaluate(_LOSE)
        wide.set_viewport_size({"width": NARROW[0], "height": NARROW[1]})
        wide.wait_for_function("() => window.lost > 2", timeout=PATIENCE_MS)
        assert "membrane" in rig.watched()
        wide.evaluate("() => window.hear()")
        wait_until(lambda: "membrane" not in rig.watched(), "a room that was told once more", COMPILING_S)
    wait_until(lambda: rig.watched() == {"strike", "spectrum"}, "nobody who wants the membrane", COMPILING_S)
    address = page.url
    page.goto("about:blank")
    try:
        wait_until(lambda: rig.watched() == set(), "nobody who wants anything", COMPILING_S)
    finally:
        page.goto(address)
