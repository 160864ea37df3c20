from collections.abc import Iterator
from pathlib import Path

import pytest

from changes_bench import Rig


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    made = Rig(tmp_path / "panel-changes.json")
    yield made
    made.changes.close()
