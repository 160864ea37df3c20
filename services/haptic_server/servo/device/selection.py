"""From the words after --device to a device. Control thread."""

from pathlib import Path

from drumstick.parameters.scene import Scene
from haptic_server.servo.device.protocol import Device, DeviceError

KINDS = "simulated, pointer, openhaptics, replay:FILE or what an installed package gives (docs/extend.md)"


def may_be_opened_twice(words: str) -> bool:
    """True when one servo may open the device while another plays: there is no arm that both would own."""
    return words in ("simulated", "pointer") or words.startswith("replay:")


def chosen(words: str, scene: Scene, pose_is_held: bool = False, folder: Path | None = None) -> Device:
    """The device, not open yet. DeviceError when there is none of that name, or the scene has two sticks.

    `pose_is_held`: somebody holds a real arm in its neutral pose now, so that its encoders may be reset. `folder`: the
    servo's run folder, where a recorded gesture lies.
    """
    if scene.hand.why_not_live:
        raise DeviceError(f"{scene.name} {scene.hand.why_not_live}")
    kind, _, rest = words.partition(":")
    if words == "simulated":
        from haptic_server.servo.device.simulated import Simulated

        return Simulated(scene, folder)
    if words == "pointer":
        from haptic_server.servo.device.pointer import Pointed

        return Pointed(scene)
    if words == "openhaptics":
        from haptic_server.servo.device.openhaptics.device import OpenHaptics
        from haptic_server.servo.force.rendering import render

        return OpenHaptics(render, pose_is_held=pose_is_held)
    if kind == "replay" and rest:
        from haptic_server.servo.device.replay import ReplayDevice

        return ReplayDevice(Path(rest))
    from haptic_server.servo.device import own_device

    if (found := own_device.find(words)) is not None:
        return found
    raise DeviceError(f"no device {words!r}; there is {KINDS}")
