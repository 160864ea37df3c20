"""The stand-in library, compiled once; each test gets a copy with a state of its own."""

from collections.abc import Callable
from pathlib import Path

import pytest

from hd_stand_in import StandIn, build


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("stand-in"))


@pytest.fixture
def new_arm(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[], StandIn]:
    return lambda: StandIn(built, tmp_path_factory.mktemp("arm"))


@pytest.fixture
def arm(built: Path, tmp_path: Path) -> StandIn:
    return StandIn(built, tmp_path)
