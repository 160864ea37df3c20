"""A clock that moves with what is heard, and a witness of what is built."""

from typing import Any

import pytest

from drumstick.drum.build import Unplayable
from drumstick.parameters.drum import Drum as DrumOfScene
from drumstick.parameters.scene import Scene
from playing_drum import Builder, Time
from sound_server import drum as drums
from sound_server import replacement


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Time:
    found = Time()
    monkeypatch.setattr(replacement, "time", found)
    monkeypatch.setattr(drums, "time", found)
    monkeypatch.setattr(replacement, "ThreadPoolExecutor", Builder)
    return found


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[DrumOfScene]:
    """Drums that were built; one of 20 Hz cannot be."""
    found: list[DrumOfScene] = []
    build = drums.build

    def noted(scene: Scene, *given: Any) -> Any:
        found.append(scene.drum)
        if scene.drum.f01_Hz == 20.0:
            raise Unplayable("no wave fits")
        return build(scene, *given)

    monkeypatch.setattr(drums, "build", noted)
    return found
