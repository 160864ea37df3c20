"""The commands by which systemd runs a rig: each becomes one process, with the options of `drumstick up` for it."""

from dataclasses import replace
from typing import Annotated

import typer

from protocol.keys import DEFAULT_ROUTER
from rig.cli.grouped import grouped
from rig.options import (
    AudioOptions,
    DeviceOptions,
    ExitHow,
    ExitStatus,
    GatewayCliOptions,
    MainPid,
    PageOptions,
    RigFile,
    RigName,
    RigNameOrFile,
    RigOptions,
    RoomOptions,
    Scene,
)


@grouped
def servo_command(*, scene: Scene = "roll", device: DeviceOptions, rig: RigName = "main") -> None:
    """Run the force loop in the foreground, for systemd. It opens no sockets and reads no rig file."""
    from rig.supervision.parts import HAPTIC
    from rig.supervision.rig_options import checked_options
    from rig.supervision.service import become_servo

    become_servo(checked_options(frozenset({HAPTIC}), RigOptions(rig=rig), device), scene)


@grouped
def servo_reload_command(
    *, main_pid: MainPid, scene: Scene = "roll", device: DeviceOptions, rig: RigName = "main"
) -> None:
    """Used by systemd: play the scene that was asked for. Its force loop is made ready beside the one that plays.

    The options are those of the running force loop; the scene they name does not count.
    """
    del scene
    from rig.supervision.parts import HAPTIC
    from rig.supervision.rig_options import checked_options
    from rig.supervision.service import reload_servo

    reload_servo(checked_options(frozenset({HAPTIC}), RigOptions(rig=rig), device), main_pid)


@grouped
def gateway_command(*, rig_options: RigOptions, gateway: GatewayCliOptions) -> None:
    """Become the gateway between a force loop and the network."""
    from rig.supervision.parts import HAPTIC
    from rig.supervision.rig_options import checked_options
    from rig.supervision.service import become_gateway

    become_gateway(checked_options(frozenset({HAPTIC}), rig_options, gateway))


def access_command(
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    listen: Annotated[
        str | None, typer.Option(help="Loopback endpoint of the gateway.", show_default=DEFAULT_ROUTER)
    ] = None,
) -> None:
    """Become the public listener of the rig file. It runs beside the gateway."""
    from rig.options import EndpointOptions
    from rig.supervision.parts import ACCESS
    from rig.supervision.rig_options import checked_options
    from rig.supervision.service import exec_service

    exec_service(
        ACCESS,
        checked_options(
            frozenset({ACCESS}), RigOptions(rig=rig, rig_file=rig_file), EndpointOptions(listen=listen)
        ),
    )


@grouped
def sound_command(*, audio: AudioOptions, rig_options: RigOptions, room: RoomOptions) -> None:
    """Become the sound server, which waits for its device."""
    from rig.supervision.parts import SOUND
    from rig.supervision.rig_options import checked_options
    from rig.supervision.service import exec_service

    exec_service(
        SOUND, replace(checked_options(frozenset({SOUND}), rig_options, audio, room), audio_awaited=True)
    )


@grouped
def panel_command(*, page: PageOptions, rig_options: RigOptions) -> None:
    """Become the technician's page."""
    from rig.supervision.parts import PANEL
    from rig.supervision.rig_options import checked_options
    from rig.supervision.service import exec_service

    exec_service(PANEL, checked_options(frozenset({PANEL}), rig_options, page))


def servo_ticks_command(rig: RigName = "main") -> None:
    """Used by systemd: note that the scene plays. Once the servo has started with it, the scene before is forgotten."""
    from rig.supervision.service import servo_ticks

    servo_ticks(rig)


def servo_ended_command(
    how: ExitHow,
    status: ExitStatus,
    rig: RigName = "main",
) -> None:
    """Used by systemd: leave a scene that cannot play here.

    When the servo ended because this machine cannot play the new scene, the scene before comes back.
    """
    from rig.supervision.service import servo_ended

    servo_ended(rig, how, status)
