"""Whether a scene's drum can be computed at all: effects that are each in range may leave a wave no room together."""

import dataclasses
import math
from collections.abc import Generator
from contextlib import contextmanager

from drumstick.scene import Scene
from rig.fault import wrong

_DEVICE_RATE_Hz = 48_000


@contextmanager
def playable() -> Generator[None]:
    """Stop where a drum that is made inside cannot be."""
    from sound_server.build import Unplayable

    try:
        yield
    except Unplayable as error:
        wrong(str(error))


def try_drum(scene: Scene) -> None:
    """Make the scene's drum, for an audio device at 48 kHz. Raises Unplayable."""
    from sound_server.build import new_engine
    from sound_server.events import StrikeRing

    # The finest mesh that `auto` may choose leaves a wave the most room.
    finest = dataclasses.replace(
        scene.mesh, accuracy="standard", rate_Hz=_DEVICE_RATE_Hz, cpu_budget=math.inf
    )
    mesh = finest if scene.mesh.accuracy == "auto" else scene.mesh
    new_engine(dataclasses.replace(scene, mesh=mesh), _DEVICE_RATE_Hz, StrikeRing())
