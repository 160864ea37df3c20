"""The commands by which systemd runs a rig: each becomes one process, with the options of `drumstick up` for it."""

from dataclasses import replace

from rig.cli.grouped import grouped
from rig.options import (
    Arm,
    Ends,
    ExitHow,
    ExitStatus,
    Gateway,
    Hall,
    ListenOrFile,
    Page,
    RigFile,
    RigName,
    RigNameOrFile,
    Scene,
    Speaker,
)


@grouped
def servo_command(*, scene: Scene = "roll", arm: Arm, rig: RigName = "main") -> None:
    """Run the force loop in the foreground, for systemd. Without a rig file it stays off the network."""
    from rig.supervision.plan import HAPTIC
    from rig.supervision.rig_options import chosen
    from rig.supervision.service import become_servo

    become_servo(chosen(frozenset({HAPTIC}), Ends(rig=rig), arm), scene)


@grouped
def gateway_command(*, ends: Ends, gateway: Gateway) -> None:
    """Become the gateway between a force loop and the network."""
    from rig.supervision.plan import HAPTIC
    from rig.supervision.rig_options import chosen
    from rig.supervision.service import become_gateway

    become_gateway(chosen(frozenset({HAPTIC}), ends, gateway))


def door_command(
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    listen: ListenOrFile = None,
) -> None:
    """Become the public listener that the rig file describes, beside the gateway."""
    from rig.options import Doors
    from rig.supervision.plan import DOOR
    from rig.supervision.rig_options import chosen
    from rig.supervision.service import become

    become(DOOR, chosen(frozenset({DOOR}), Ends(rig=rig, rig_file=rig_file), Doors(listen=listen)))


@grouped
def sound_command(*, speaker: Speaker, ends: Ends, hall: Hall) -> None:
    """Become the sound server, which waits for its device."""
    from rig.supervision.plan import SOUND
    from rig.supervision.rig_options import chosen
    from rig.supervision.service import become

    become(SOUND, replace(chosen(frozenset({SOUND}), ends, speaker, hall), audio_awaited=True))


@grouped
def panel_command(*, page: Page, ends: Ends) -> None:
    """Become the technician's page."""
    from rig.supervision.plan import PANEL
    from rig.supervision.rig_options import chosen
    from rig.supervision.service import become

    become(PANEL, chosen(frozenset({PANEL}), ends, page))


def servo_ticks_command(rig: RigName = "main") -> None:
    """For the servo's unit, after its start: the scene plays, and needs no way back any more."""
    from rig.supervision.service import servo_ticks

    servo_ticks(rig)


def servo_ended_command(
    how: ExitHow,
    status: ExitStatus,
    rig: RigName = "main",
) -> None:
    """For the servo's unit, after its end: a scene that cannot be played here gives way to the one before."""
    from rig.supervision.service import servo_ended

    servo_ended(rig, how, status)
