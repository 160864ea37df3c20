"""What tests of a whole rig share: each module has a `rig` of its own."""

import socket
from collections.abc import Iterator

import pytest
import zenoh
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
