"""The recorded gesture of a scene: checked once, when the scene is, and read by the servo. Control threads.

Whoever starts the servo puts the file into its run folder, because the scene's own folder may be another's.
"""

from collections.abc import Iterable
from pathlib import Path

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.safety.envelope import OutOfEnvelope
from drumstick.scenes import gesture as scene_gesture
from drumstick.scenes.recording import MAX_BYTES, Recording, TrajectoryError
from drumstick.stick.law import law_of
from haptic_server.limits import limits_of
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.specification import EXACT_STICK
from realtime.regular_file import read_lines


def _refusal(scene: Scene, z_m: float) -> str:
    # Why the envelope would not let a hand of the exact stick hold its spring there.
    law = law_of(scene)
    law["z_ss"] = z_m
    try:
        envelope.require(law, limits_of(scene, EXACT_STICK))
    except OutOfEnvelope as refusal:
        return str(refusal)
    return ""


def gesture_of(lines: Iterable[str], source: str, scene: Scene) -> Recording:
    """The gesture in `lines`, inside what guard, `[stick]` and envelope allow. TrajectoryError names line and limit.

    A hand that lifts the exact stick's spring is judged there too; the firmest and loosest grip is `[stick]` itself.
    """
    lifted_m = scene.guard.highest_m
    if scene.device.plant != "stick" or not _refusal(scene, lifted_m):
        return scene_gesture.gesture_of(lines, source, scene)
    accepted_m = scene.stick.z_ss_m

    def refused(row: tuple[float, ...]) -> str:
        nonlocal accepted_m
        if not row[scene_gesture.Z] > accepted_m:
            return ""
        accepted_m = row[scene_gesture.Z]
        why = _refusal(scene, accepted_m)
        return why and f"z_m: {accepted_m:g} m: {why}"

    return scene_gesture.gesture_of(lines, source, scene, refused)


def read(path: Path, scene: Scene) -> Recording:
    """The gesture in the run folder. DeviceError when it is not there or not good."""
    try:
        return gesture_of(read_lines(path, MAX_BYTES), scene.hand.gesture_file, scene)
    except (TrajectoryError, UnicodeDecodeError) as error:
        raise DeviceError(str(error)) from None
    except OSError as error:
        raise DeviceError(f"the recorded gesture {path} cannot be read: {error.strerror}") from None
