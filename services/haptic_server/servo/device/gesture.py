"""The recorded gesture of a scene: checked once, when the scene is, and read by the servo. Control threads.

Whoever starts the servo puts the file into its run folder, because the scene's own folder may be another's.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from drumstick.parameters.scene import Scene
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.servo.simulation.recording import MAX_BYTES, Recording, TrajectoryError, recording_of
from realtime.regular_file import read_lines

# What the guard limits is the stick: a mass on a spring goes up to twice as fast as the end of its spring.
_OF_THE_STICKS = 0.5
_UNHURRIED = 0.25  # of the speed that the guard allows: the way back is no stroke
_MIN_BACK_S = 0.01


def gesture_of(lines: Iterable[str], source: str, scene: Scene) -> Recording:
    """The gesture in `lines`, inside what the scene's guard allows. TrajectoryError names line, value and limit.

    The hand may move half as fast as [guard] max_speed_m_per_s. It is played again and again: where it ends elsewhere
    than it began, the hand goes back before it starts anew.
    """
    guard = scene.guard
    recording = recording_of(
        lines, source, guard.lowest_m, guard.highest_m, _OF_THE_STICKS * guard.max_speed_m_per_s
    )
    first, last = recording[0], recording[-1]
    apart_m = abs(float(last[3] - first[3]))
    if apart_m == 0.0:
        return recording
    back = first.copy()
    back[0] = last[0] + max(apart_m / (_UNHURRIED * guard.max_speed_m_per_s), _MIN_BACK_S)
    return np.vstack([recording, back])


def read(path: Path, scene: Scene) -> Recording:
    """The gesture in the run folder. DeviceError when it is not there or not good."""
    try:
        return gesture_of(read_lines(path, MAX_BYTES), scene.hand.gesture_file, scene)
    except (TrajectoryError, UnicodeDecodeError) as error:
        raise DeviceError(str(error)) from None
    except OSError as error:
        raise DeviceError(f"the recorded gesture {path} cannot be read: {error.strerror}") from None
