"""The commands that play: the whole rig, or one of its parts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.cli.options import (
    Also,
    Audio,
    AudioBlock,
    AudioRate,
    Connect,
    Device,
    Duration,
    Fresh,
    Json,
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
    Record,
    RecordForce,
    RigFile,
    RigNameOrFile,
    RoomLatency,
    RoomLevel,
    Scene,
)

if TYPE_CHECKING:
    from rig.supervision.plan import Options


def chosen(
    part: frozenset[str],
    rig_file: Path | None,
    rig: str | None,
    *,
    device: str = "simulated",
    pose_is_held: bool = False,
    audio: str = "auto",
    connect: str | None = None,
    listen: str | None = None,
    osc_in: int | None = None,
    osc_out: list[str] | None = None,
    prefix: str = "/drumstick",
    panel_port: int = 8080,
    fresh: bool = False,
    also: list[str] | None = None,
    most_rigs: int = 8,
    room_latency: float = 0.0,
    room_level: float = 0.0,
    audio_rate: int = 48000,
    audio_block: int = 128,
    record: Path | None = None,
    record_force: bool = False,
    oscquery: str | None = None,
    oscquery_announce: bool = False,
    midi_out: str | None = None,
    midi_note: int = 38,
    midi_channel: int = 10,
) -> Options:
    """What the command line and the rig file say together, checked. Raises Stop."""
    from rig import checks, folder
    from rig.supervision.plan import Options
    from rig.supervision.settled import settle

    checks.room(room_latency, room_level)
    checks.port(panel_port, "--panel-port")
    checks.finite(audio_rate, "--audio-rate", 22050.0, 192000.0, "Hz")
    checks.finite(audio_block, "--audio-block", 16.0, 8192.0, "frames")
    checks.prefix(prefix)
    checks.device(device)
    query = checks.oscquery(oscquery, oscquery_announce)
    if midi_out is not None:
        checks.midi(midi_out, midi_note, midi_channel)
    ends = settle(
        part, rig_file, rig=rig, connect=connect, listen=listen, osc_in=osc_in, osc_out=osc_out
    )  # fmt: skip
    checks.sound_rigs(ends.rig, also or (), most_rigs)
    host, port = ends.osc_bind
    return Options(
        ends.rig, folder.run_folder(ends.rig), folder.state_folder(ends.rig), device=device,
        pose_is_held=pose_is_held, audio=audio, connect=ends.connect, listen=ends.listen, osc_in=port,
        osc_out=ends.osc_targets, prefix=prefix, panel_port=panel_port, audio_rate=audio_rate,
        audio_block=audio_block, fresh=fresh, also=tuple(also or ()), parts=part, record=record,
        record_force=record_force, osc_host=host, osc_allow=ends.osc_allow, public=ends.public,
        identity=ends.identity, oscquery=query, oscquery_announce=oscquery_announce, midi_out=midi_out,
        midi_note=midi_note, midi_channel=midi_channel, most_rigs=most_rigs, room_latency_ms=room_latency,
        room_level_dB=room_level,
    )  # fmt: skip


def _run(
    part: frozenset[str],
    rig_file: Path | None,
    rig: str | None,
    duration: float | None,
    as_json: bool,
    *,
    scene: str = "roll",
    **wishes: Any,
) -> None:
    from rig import checks
    from rig.supervision.up import up

    checks.duration(duration)
    if wishes.get("midi_out") == "list":
        from rig.machine.midi_ports import show

        checks.midi("list", wishes["midi_note"], wishes["midi_channel"])
        show(as_json)
        return
    up(chosen(part, rig_file, rig, **wishes), scene, duration, as_json)


def up_command(
    scene: Scene = "roll",
    duration: Duration = None,
    device: Device = "simulated",
    pose_is_held: PoseIsHeld = False,
    audio: Audio = "auto",
    audio_rate: AudioRate = 48000,
    audio_block: AudioBlock = 128,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    listen: ListenOrFile = None,
    osc_in: OscInOrFile = None,
    osc_out: OscOut = None,
    prefix: Prefix = "/drumstick",
    panel_port: PanelPort = 8080,
    fresh: Fresh = False,
    record: Record = None,
    record_force: RecordForce = False,
    oscquery: OscQuery = None,
    oscquery_announce: OscQueryAnnounce = False,
    midi_out: MidiOut = None,
    midi_note: MidiNote = 38,
    midi_channel: MidiChannel = 10,
    as_json: Json = False,
) -> None:
    """Play: force loop, sound and panel together, until Ctrl-C."""
    _run(
        frozenset({"haptic", "door", "sound", "panel"}), rig_file, rig, duration, as_json, scene=scene, device=device,
        pose_is_held=pose_is_held, audio=audio, audio_rate=audio_rate, audio_block=audio_block,
        connect=connect, listen=listen, osc_in=osc_in, osc_out=osc_out, prefix=prefix, panel_port=panel_port,
        fresh=fresh, record=record, record_force=record_force,
        oscquery=oscquery, oscquery_announce=oscquery_announce,
        midi_out=midi_out, midi_note=midi_note, midi_channel=midi_channel,
    )  # fmt: skip


def haptic_command(
    scene: Scene = "roll",
    duration: Duration = None,
    device: Device = "simulated",
    pose_is_held: PoseIsHeld = False,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    listen: ListenOrFile = None,
    osc_in: OscInOrFile = None,
    osc_out: OscOut = None,
    prefix: Prefix = "/drumstick",
    fresh: Fresh = False,
    record: Record = None,
    record_force: RecordForce = False,
    oscquery: OscQuery = None,
    oscquery_announce: OscQueryAnnounce = False,
    midi_out: MidiOut = None,
    midi_note: MidiNote = 38,
    midi_channel: MidiChannel = 10,
    as_json: Json = False,
) -> None:
    """Only the force loop and its gateway."""
    _run(
        frozenset({"haptic", "door"}), rig_file, rig, duration, as_json, scene=scene, device=device,
        pose_is_held=pose_is_held, connect=connect, listen=listen, osc_in=osc_in, osc_out=osc_out, prefix=prefix,
        fresh=fresh, record=record, record_force=record_force,
        oscquery=oscquery, oscquery_announce=oscquery_announce,
        midi_out=midi_out, midi_note=midi_note, midi_channel=midi_channel,
    )  # fmt: skip


def sound_command(
    audio: Audio = "auto",
    audio_rate: AudioRate = 48000,
    audio_block: AudioBlock = 128,
    duration: Duration = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    also: Also = None,
    most_rigs: MostRigs = 8,
    room_latency: RoomLatency = 0.0,
    room_level: RoomLevel = 0.0,
    as_json: Json = False,
) -> None:
    """Only the sound server; each rig's scene comes from its haptic server."""
    _run(
        frozenset({"sound"}), rig_file, rig, duration, as_json, audio=audio, connect=connect, also=also,
        audio_rate=audio_rate, audio_block=audio_block, most_rigs=most_rigs, room_latency=room_latency,
        room_level=room_level,
    )  # fmt: skip


def panel_command(
    panel_port: PanelPort = 8080,
    duration: Duration = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Only the technician's page."""
    _run(frozenset({"panel"}), rig_file, rig, duration, as_json, connect=connect, panel_port=panel_port)
