"""The commands that play: the whole rig, or one of its parts."""

from rig.cli.grouped import grouped
from rig.options import Duration, Ends, Hall, Haptic, Json, Outlets, Page, Scene, Speaker, Take


def _ports_listed(outlets: Outlets, as_json: bool) -> bool:
    # `--midi-out list` shows the ports instead of playing.
    if outlets.midi_out != "list":
        return False
    from rig import checks
    from rig.machine.midi_ports import show

    checks.midi("list", outlets.midi_note, outlets.midi_channel)
    show(as_json)
    return True


@grouped
def up_command(
    *,
    scene: Scene = "roll",
    duration: Duration = None,
    haptic: Haptic,
    speaker: Speaker,
    ends: Ends,
    page: Page,
    take: Take,
    as_json: Json = False,
) -> None:
    """Play: force loop, sound and panel together, until Ctrl-C."""
    from rig.supervision.plan import DOOR, HAPTIC, PANEL, SOUND
    from rig.supervision.rig_options import chosen
    from rig.supervision.up import up

    if not _ports_listed(haptic, as_json):
        parts = frozenset({HAPTIC, DOOR, SOUND, PANEL})
        up(chosen(parts, ends, haptic, speaker, page, take), scene, duration, as_json)


@grouped
def haptic_command(
    *,
    scene: Scene = "roll",
    duration: Duration = None,
    haptic: Haptic,
    ends: Ends,
    take: Take,
    as_json: Json = False,
) -> None:
    """Only the force loop and its gateway."""
    from rig.supervision.plan import DOOR, HAPTIC
    from rig.supervision.rig_options import chosen
    from rig.supervision.up import up

    if not _ports_listed(haptic, as_json):
        up(chosen(frozenset({HAPTIC, DOOR}), ends, haptic, take), scene, duration, as_json)


@grouped
def sound_command(
    *, speaker: Speaker, duration: Duration = None, ends: Ends, hall: Hall, as_json: Json = False
) -> None:
    """Only the sound server; each rig's scene comes from its haptic server."""
    from rig.supervision.plan import SOUND
    from rig.supervision.rig_options import chosen
    from rig.supervision.up import up

    up(chosen(frozenset({SOUND}), ends, speaker, hall), "roll", duration, as_json)


@grouped
def panel_command(*, page: Page, duration: Duration = None, ends: Ends, as_json: Json = False) -> None:
    """Only the technician's page."""
    from rig.supervision.plan import PANEL
    from rig.supervision.rig_options import chosen
    from rig.supervision.up import up

    up(chosen(frozenset({PANEL}), ends, page), "roll", duration, as_json)
