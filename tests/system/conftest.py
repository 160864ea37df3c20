"""Fixtures of tests of a whole rig: each module has a `rig` of its own; panel and browser are started once.

One panel, of one fake rig, and one browser serve all modules that a worker runs; `faked.begin_again()` comes before
each test that asks or looks. Whoever looks for words that an earlier module may have left on the page takes
`module_panel`, whoever ends a rig or a panel `own_rig` and `own_panel`.
"""

import re
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
import zenoh
from browser import PATIENCE_MS, chromium, page_at
from fake_rig import FakeRig
from jack_server import Jack, jack_server
from lan_page import Opened, opened_panel
from osc_port import OscPort
from panel_process import PanelProcess, panel
from playwright.sync_api import Browser, Error, Page
from public_stage import Stage
from rig_process import Rig

from drumstick.scenes.scene_text import parse, shipped_text
from ports import free_port
from rig.accuracy_files import SHIPPED


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Report of a test that failed with a page: the page's words too; its picture and HTML in .pytest_cache/d/pages."""
    report = yield
    page = getattr(item, "funcargs", {}).get("page")
    if report.when == "call" and report.failed and isinstance(page, Page):
        report.sections.append(("Page", _kept(page, item)))
    return report


def _kept(page: Page, item: pytest.Item) -> str:
    assert item.config.cache is not None
    file = item.config.cache.mkdir("pages") / re.sub(r"\W+", "-", item.nodeid)
    try:
        file.with_suffix(".html").write_text(page.content(), encoding="utf-8")
        page.screenshot(path=file.with_suffix(".png"))
        return page.inner_text("body")
    except Error as error:  # a browser that has ended
        return f"It cannot be asked: {error}"


@pytest.fixture(scope="module")
def session(rig: Rig) -> Iterator[zenoh.Session]:
    """A client of the module's rig."""
    opened = rig.client()
    yield opened
    opened.close()


@pytest.fixture
def osc(rig: Rig) -> Iterator[OscPort]:
    """The port that the module's rig sends OSC to."""
    with OscPort(rig.osc_out, rig.osc_in) as port:
        yield port


@pytest.fixture(scope="module")
def heard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file into which the module's rig sounds."""
    return tmp_path_factory.mktemp("sound") / "heard.wav"


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium, for all pages. While it is there, asyncio runs only in threads of its own."""
    with chromium() as started:
        yield started


def _roll() -> FakeRig:
    return FakeRig(parse(shipped_text("roll"), "roll.toml"))


@pytest.fixture(scope="session")
def faked() -> Iterator[FakeRig]:
    """The panel's fake rig; tests take it as `rig`, after `begin_again`."""
    made = _roll()
    yield made
    made.close()


@pytest.fixture(scope="session")
def served(faked: FakeRig, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PanelProcess]:
    """The panel of the fake rig."""
    token = tmp_path_factory.mktemp("panel") / "token"
    with panel(faked.endpoint, free_port(), token, accuracy_shipped=SHIPPED) as running:
        yield running


@pytest.fixture(scope="session")
def lan(faked: FakeRig, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    """The fake rig's panel that is open to the network."""
    with opened_panel(faked.endpoint, tmp_path_factory.mktemp("lan")) as opened:
        yield opened


@pytest.fixture(scope="module")
def module_panel(faked: FakeRig, tmp_path_factory: pytest.TempPathFactory) -> Iterator[PanelProcess]:
    """The module's own panel of the fake rig: what a panel said last, and its presets, it says to the next page too."""
    faked.begin_again()
    faked.presets.clear()
    with panel(faked.endpoint, free_port(), tmp_path_factory.mktemp("panel") / "token") as running:
        yield running


@pytest.fixture(scope="module")
def page(browser: Browser, faked: FakeRig, served: PanelProcess) -> Iterator[Page]:
    """The module's page of the panel."""
    faked.begin_again()
    with page_at(browser, served.address, PATIENCE_MS) as shown:
        yield shown


@pytest.fixture
def own_rig() -> Iterator[FakeRig]:
    """A fake rig that the test may end."""
    made = _roll()
    yield made
    made.close()


@pytest.fixture
def own_panel(own_rig: FakeRig, tmp_path: Path) -> Iterator[PanelProcess]:
    """Its panel, which the test may end."""
    with panel(own_rig.endpoint, free_port(), tmp_path / "token") as running:
        yield running


@pytest.fixture
def jack(own_folders: dict[str, str], tmp_path: Path) -> Iterator[Jack]:
    """The test's own JACK server, two outputs, 128 frames at 48 kHz."""
    with jack_server(own_folders, tmp_path) as started:
        yield started


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    """The module's haptic machine with a public listener."""
    made = Stage(tmp_path_factory.mktemp("stage"))
    try:
        yield made
    finally:
        made.rig.close()


@pytest.fixture(scope="module")
def local(stage: Stage) -> Iterator[zenoh.Session]:
    """A process of the haptic machine."""
    opened = stage.rig.client()
    yield opened
    opened.close()
