"""Scene of the next servo where no `drumstick up` remembers it: systemd starts it, and knows of no scenes.

Everything lies in the run folder. For what starts a servo or follows its end, and so has claimed the folder, and for
a reload beside the servo that plays.
"""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path

from protocol.keys import DEFAULT_RIG, command
from realtime.regular_file import read_text
from rig import folder, scene_file
from rig.exit_status import GIVEN, LACKING, CommandError
from rig.scene_file import Say, SceneFiles
from rig.supervision.scenes import requested_scene

CONFIGURED = "scene.configured"  # hash of the scene that was laid out because the options name it
_MAX_BYTES = 500_000_000  # a recorded gesture, as JSON beside its scene
BEFORE = "scene.before"  # the scene to go back to, until the one that somebody asked for has played


def _lying(run: Path) -> SceneFiles | None:
    # None where there is no scene yet, or one that this version does not understand.
    from drumstick.scenes.scene_text import SceneError, parse
    from haptic_server import files

    try:
        text = read_text(run / files.SCENE, files.MAX_SCENE_BYTES)
        name = parse(text, files.SCENE).name
    except (OSError, UnicodeDecodeError, SceneError):
        return None
    return SceneFiles(name, text, _read(run / files.GESTURE) or None)


def _mark(scene: SceneFiles) -> str:
    files = {name: value for name, value in asdict(scene).items() if name != "place"}
    return hashlib.sha256(json.dumps(files).encode()).hexdigest()


def _read(path: Path) -> str:
    # What cannot be read is as good as not there.
    try:
        return read_text(path, _MAX_BYTES)
    except (OSError, UnicodeDecodeError):
        return ""


def install_scene(run: Path, configured: str, say: Say, rig: str = DEFAULT_RIG) -> None:
    """Put the scene for the servo that starts now: one that somebody asked for, or the one of the options.

    A servo that crashed finds its scene and its block as they were; so does one that a panic or a fault holds,
    whatever is asked for. The configured scene is put where none lies, and where the options changed. `rig`: as the
    words of it name it. Raises CommandError.
    """
    from haptic_server import block_header

    requested_scene.clear_leftovers(run)  # no servo plays: nobody makes another ready beside it
    lying, wanted = _lying(run), requested_scene.take(run, say)
    first = scene_file.scene_files(configured, say)
    is_new = _read(run / CONFIGURED) != _mark(first)
    if lying is not None and wanted is None and not is_new:
        return
    if lying is not None and block_header.was_held(run):
        say(held_words(rig, as_unit=True))
    elif wanted is not None and lying is not None and not is_new:
        say(f"another scene: {wanted.name}")
        keep_way_back(run)
        wanted.put(run)
    else:
        (run / BEFORE).unlink(missing_ok=True)
        first.put(run)
        folder.put_text(run / CONFIGURED, _mark(first))


def held_words(rig: str, as_unit: bool = False) -> str:
    """Words of a refusal while a panic or a fault holds the rig; `as_unit`: one that systemd started."""
    arm = f"sudo drumstick-at {rig} arm" if as_unit else command("arm", rig)
    return f"a panic or a fault is latched: the scene stays; {arm} first"


def keep_way_back(run: Path) -> None:
    """Keep the scene that lies there, until another one has played. Raises CommandError."""
    if (lying := _lying(run)) is not None:
        folder.put_text(run / BEFORE, json.dumps(asdict(lying)))


def played(run: Path) -> None:
    """The servo ticks: what it plays needs no way back any more."""
    (run / BEFORE).unlink(missing_ok=True)


def ended(run: Path, status: int, say: Say) -> None:
    """The servo ended with this exit status: where it could not play what was asked for, go back. Raises
    CommandError."""
    kept = _read(run / BEFORE)
    if not kept or status not in (GIVEN, LACKING):
        return
    say("that scene cannot be played here: back to the previous scene")
    (run / BEFORE).unlink(missing_ok=True)
    try:
        SceneFiles(**json.loads(kept)).put(run)
    except (ValueError, TypeError) as damaged:  # then the configured one is laid out at the next start
        (run / CONFIGURED).unlink(missing_ok=True)
        raise CommandError(GIVEN, f"{run / BEFORE}: {damaged}") from None
