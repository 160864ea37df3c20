"""What tests of a whole rig share: each module has a `rig` of its own."""

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
