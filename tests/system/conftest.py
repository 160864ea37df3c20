"""What tests of a whole rig share: each module has a `rig` of its own."""

import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import zenoh
from browser import chromium
from fake_rig import FakeRig
from panel_process import PanelProcess, panel
from playwright.sync_api import Browser
from rig_process import Rig


@pytest.fixture(scope="module")
def session(rig: Rig) -> Iterator[zenoh.Session]:
    """A client of the module's rig."""
    opened = rig.client()
    yield opened
    opened.close()


@pytest.fixture
def osc(rig: Rig) -> Iterator[socket.socket]:
    """The port that the module's rig sends OSC to."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", rig.osc_out))
        sock.settimeout(10.0)
        yield sock


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium, for a module's pages."""
    with chromium() as started:
        yield started


@pytest.fixture
def served(rig: FakeRig, tmp_path: Path, free_port: Callable[[], int]) -> Iterator[PanelProcess]:
    """A panel of the module's fake rig."""
    with panel(rig.endpoint, free_port(), tmp_path / "token") as running:
        yield running
