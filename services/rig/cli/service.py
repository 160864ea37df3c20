"""The commands by which systemd runs a rig: each becomes one process, with the options of `drumstick up` for it."""

from dataclasses import replace

from rig.cli.options import (
    Also,
    Audio,
    AudioBlock,
    AudioRate,
    Connect,
    Device,
    ExitHow,
    ExitStatus,
    Fresh,
    ListenOrFile,
    MidiChannel,
    MidiNote,
    MidiOut,
    MostRigs,
    OscInOrFile,
    OscOut,
    OscQuery,
    OscQueryAnnounce,
    PanelPort,
    PoseIsHeld,
    Prefix,
    RigFile,
    RigName,
    RigNameOrFile,
    RoomLatency,
    RoomLevel,
    Scene,
)
from rig.cli.play import chosen

_HAPTIC, _DOOR = frozenset({"haptic"}), frozenset({"door"})
_SOUND, _PANEL = frozenset({"sound"}), frozenset({"panel"})


def servo_command(
    scene: Scene = "roll",
    device: Device = "simulated",
    pose_is_held: PoseIsHeld = False,
    rig: RigName = "main",
) -> None:
    """Become the force loop, for the scene that is due; the scene is for the gateway too. No rig file: no network."""
    from rig.supervision.service import become_servo

    become_servo(chosen(_HAPTIC, None, rig, device=device, pose_is_held=pose_is_held), scene)


def gateway_command(
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    listen: ListenOrFile = None,
    osc_in: OscInOrFile = None,
    osc_out: OscOut = None,
    prefix: Prefix = "/drumstick",
    fresh: Fresh = False,
    oscquery: OscQuery = None,
    oscquery_announce: OscQueryAnnounce = False,
    midi_out: MidiOut = None,
    midi_note: MidiNote = 38,
    midi_channel: MidiChannel = 10,
) -> None:
    """Become the gateway between a force loop and the network."""
    from rig.supervision.service import become_gateway

    become_gateway(
        chosen(
            _HAPTIC, rig_file, rig, connect=connect, listen=listen, osc_in=osc_in, osc_out=osc_out,
            prefix=prefix, fresh=fresh, oscquery=oscquery, oscquery_announce=oscquery_announce,
            midi_out=midi_out, midi_note=midi_note, midi_channel=midi_channel,
        )
    )  # fmt: skip


def door_command(
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    listen: ListenOrFile = None,
) -> None:
    """Become the public listener that the rig file describes, beside the gateway."""
    from rig.supervision.service import become

    become("door", chosen(_DOOR, rig_file, rig, listen=listen))


def sound_command(
    audio: Audio = "auto",
    audio_rate: AudioRate = 48000,
    audio_block: AudioBlock = 128,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    also: Also = None,
    most_rigs: MostRigs = 8,
    room_latency: RoomLatency = 0.0,
    room_level: RoomLevel = 0.0,
) -> None:
    """Become the sound server, which waits for its device."""
    from rig.supervision.service import become

    wanted = chosen(
        _SOUND, rig_file, rig, audio=audio, audio_rate=audio_rate, audio_block=audio_block,
        connect=connect, also=also, most_rigs=most_rigs, room_latency=room_latency, room_level=room_level,
    )  # fmt: skip
    become("sound", replace(wanted, audio_awaited=True))


def panel_command(
    panel_port: PanelPort = 8080,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
) -> None:
    """Become the technician's page."""
    from rig.supervision.service import become

    become("panel", chosen(_PANEL, rig_file, rig, panel_port=panel_port, connect=connect))


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
