"""Checks whether a scene can be played at all, though each of its values is in range.

Its drum: effects may leave a wave no room together. Its stick: the servo starts with no set outside the envelope.
"""

import dataclasses
import math
from collections.abc import Generator
from contextlib import contextmanager

from drumstick.parameters.scene import Scene
from rig.exit_status import usage_error
from sound_server.ranges import DEFAULT_RATE_HZ


@contextmanager
def playable() -> Generator[None]:
    """Stop where a drum that is made inside cannot be."""
    from drumstick.drum.build import Unplayable

    try:
        yield
    except Unplayable as error:
        usage_error(str(error))


def try_stick(scene: Scene) -> None:
    """Judge the scene's own set for its simulated device, as the servo does at its start. Raises CommandError."""
    from drumstick.safety.envelope import OutOfEnvelope
    from haptic_server.servo.offline import require_playable

    try:
        require_playable(scene)
    except OutOfEnvelope as refusal:
        usage_error(str(refusal))


def try_drum(scene: Scene) -> None:
    """Make the scene's drum, for an audio device at 48 kHz. Raises Unplayable."""
    from drumstick.drum.build import new_engine
    from drumstick.drum.memory.strikes import StrikeRing

    # The finest mesh that `auto` may choose leaves a wave the most room.
    finest = dataclasses.replace(
        scene.mesh, accuracy="standard", rate_Hz=DEFAULT_RATE_HZ, cpu_budget=math.inf
    )
    mesh = finest if scene.mesh.accuracy == "auto" else scene.mesh
    new_engine(dataclasses.replace(scene, mesh=mesh), DEFAULT_RATE_HZ, StrikeRing())
