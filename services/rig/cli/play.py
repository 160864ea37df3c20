"""The commands that play: the whole rig, or one of its parts."""

import logging

from rig.cli.grouped import grouped
from rig.options import (
    DEFAULT_SCENE,
    AudioOptions,
    Duration,
    HapticOptions,
    Json,
    OutputOptions,
    PageOptions,
    PortOptions,
    RecordOptions,
    RigOptions,
    RoomOptions,
    SceneOptions,
)


def _ports_listed(outputs: OutputOptions, as_json: bool) -> bool:
    # `--midi-out list` and `--midi-in list` show the ports instead of playing.
    if "list" not in (outputs.midi_out, outputs.midi_in):
        return False
    from rig import service_checks
    from rig.machine.midi_ports import show

    service_checks.midi("list", outputs.midi_note, outputs.midi_channel)
    show(as_json, listens=outputs.midi_in == "list")
    return True


@grouped
def up_command(
    *,
    scenes: SceneOptions,
    haptic_options: HapticOptions,
    audio: AudioOptions,
    rig_options: RigOptions,
    page: PageOptions,
    ports: PortOptions,
    recording: RecordOptions,
    as_json: Json = False,
) -> None:
    """Play: force loop, sound and panel together, until Ctrl-C."""
    from realtime.log import say
    from rig import extras
    from rig.supervision.parts import ACCESS, HAPTIC, PANEL, SOUND
    from rig.supervision.rig_options import checked_options, with_free_ports
    from rig.supervision.up import up

    if not _ports_listed(haptic_options, as_json):
        parts = frozenset({HAPTIC, ACCESS, SOUND, PANEL})
        if line := extras.what_to_type("panel"):
            say(
                logging.WARNING,
                f"drumstick: it plays without the technician's page; for the page type: {line}",
            )
            parts -= {PANEL}
        options = checked_options(parts, rig_options, haptic_options, audio, page, recording)
        up(
            with_free_ports(options) if ports.port else options,
            scenes.scene,
            scenes.duration,
            as_json,
            scenes.set_list,
        )


@grouped
def haptic_command(
    *,
    scenes: SceneOptions,
    haptic_options: HapticOptions,
    rig_options: RigOptions,
    recording: RecordOptions,
    as_json: Json = False,
) -> None:
    """Only the force loop and its gateway."""
    from rig.supervision.parts import ACCESS, HAPTIC
    from rig.supervision.rig_options import checked_options
    from rig.supervision.up import up

    if not _ports_listed(haptic_options, as_json):
        up(
            checked_options(frozenset({HAPTIC, ACCESS}), rig_options, haptic_options, recording),
            scenes.scene,
            scenes.duration,
            as_json,
            scenes.set_list,
        )


@grouped
def sound_command(
    *,
    audio: AudioOptions,
    duration: Duration = None,
    rig_options: RigOptions,
    room: RoomOptions,
    as_json: Json = False,
) -> None:
    """Start only the sound server. Each rig's scene comes from its haptic server."""
    from rig.supervision.parts import SOUND
    from rig.supervision.rig_options import checked_options
    from rig.supervision.up import up

    up(checked_options(frozenset({SOUND}), rig_options, audio, room), DEFAULT_SCENE, duration, as_json)


@grouped
def panel_command(
    *, page: PageOptions, duration: Duration = None, rig_options: RigOptions, as_json: Json = False
) -> None:
    """Only the technician's page."""
    from rig.supervision.parts import PANEL
    from rig.supervision.rig_options import checked_options
    from rig.supervision.up import up

    up(checked_options(frozenset({PANEL}), rig_options, page), DEFAULT_SCENE, duration, as_json)
