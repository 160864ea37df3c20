"""The recorded gesture of a scene: checked once, when the scene is, and read by the servo. Control threads.

Whoever starts the servo puts the file into its run folder, because the scene's own folder may be another's.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from drumstick.scene import Scene
from haptic_server.device.protocol import DeviceError
from haptic_server.device.recording import Recording, RecordingError, recording_of


def gesture_of(lines: Iterable[str], source: str, scene: Scene) -> Recording:
    """The gesture in `lines`, inside what the scene's guard allows. RecordingError names line, value and limit."""
    guard = scene.guard
    recording = recording_of(lines, source, guard.lowest_m, guard.highest_m)
    speeds = np.abs(np.diff(recording[:, 3]) / np.diff(recording[:, 0]))
    fastest = int(np.argmax(speeds))
    if not speeds[fastest] <= guard.max_speed_m_per_s:
        t = recording[fastest, 0]
        raise RecordingError(
            f"{source}: z_m moves at {speeds[fastest]:.3g} m/s, {t:.6g} s after the first row; "
            f"[guard] max_speed_m_per_s is {guard.max_speed_m_per_s:g} m/s"
        )
    return recording


def read(path: Path, scene: Scene) -> Recording:
    """The gesture in the run folder. DeviceError when it is not there or not good."""
    try:
        with path.open(encoding="utf-8", newline="") as lines:
            return gesture_of(lines, scene.hand.gesture_file, scene)
    except (RecordingError, UnicodeDecodeError) as error:
        raise DeviceError(str(error)) from None
    except OSError as error:
        raise DeviceError(f"the recorded gesture {path} cannot be read: {error.strerror}") from None
