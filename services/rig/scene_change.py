"""Which scene the next servo plays, where no `drumstick up` remembers: systemd starts it, and knows of no scenes.

Everything lies in the run folder, which the caller has claimed: no servo runs.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from protocol.keys import DEFAULT_RIG, command
from rig import folder, scene_file
from rig.fault import GIVEN, LACKING, Stop
from rig.laid_out import LaidOut

CONFIGURED = "scene.configured"  # hash of the scene that was laid out because the options name it
BEFORE = "scene.before"  # the scene to go back to, until the one that somebody asked for has played

Say = Callable[[str], None]


def _lying(run: Path) -> LaidOut | None:
    # None where there is no scene yet, or one that this version does not understand.
    from drumstick.scene import SceneError, parse
    from haptic_server import files

    try:
        text = (run / files.SCENE).read_text(encoding="utf-8")
        name = parse(text, files.SCENE).name
    except (FileNotFoundError, SceneError):
        return None
    gesture = run / files.GESTURE
    return LaidOut(name, text, gesture.read_text(encoding="utf-8") if gesture.is_file() else None)


def _take_wanted(run: Path) -> str | None:
    from haptic_server import files

    wanted = run / files.WANTED
    try:
        name = wanted.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    wanted.unlink(missing_ok=True)
    return name


def _mark(scene: LaidOut) -> str:
    return hashlib.sha256(json.dumps(asdict(scene)).encode()).hexdigest()


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""


def lay_out(run: Path, configured: str, say: Say, rig: str = DEFAULT_RIG) -> None:
    """Put the scene for the servo that starts now: one that somebody asked for, or the one of the options.

    A servo that crashed finds its scene and its block as they were; so does one that a panic or a fault holds,
    whatever is asked for. The configured scene is put where none lies, and where the options changed. `rig`: as the
    words of it name it. Raises Stop.
    """
    from haptic_server import front

    lying, wanted = _lying(run), _take_wanted(run)
    first = scene_file.laid_out(configured)
    is_new = _read(run / CONFIGURED) != _mark(first)
    if lying is not None and wanted is None and not is_new:
        return
    if lying is not None and front.was_held(run):
        say(f"a panic or a fault is latched: the scene stays; {command('arm', rig)} first")
    elif wanted is not None and lying is not None and not is_new:
        say(f"another scene: {wanted}")
        asked = scene_file.laid_out(wanted)
        folder.put_text(run / BEFORE, json.dumps(asdict(lying)))
        asked.put(run)
    else:
        (run / BEFORE).unlink(missing_ok=True)
        first.put(run)
        folder.put_text(run / CONFIGURED, _mark(first))


def played(run: Path) -> None:
    """The servo ticks: what it plays needs no way back any more."""
    (run / BEFORE).unlink(missing_ok=True)


def ended(run: Path, status: int, say: Say) -> None:
    """The servo ended with this exit status: where it could not play what was asked for, go back. Raises Stop."""
    kept = _read(run / BEFORE)
    if not kept or status not in (GIVEN, LACKING):
        return
    say("that scene cannot be played here: back to the one before")
    (run / BEFORE).unlink(missing_ok=True)
    try:
        LaidOut(**json.loads(kept)).put(run)
    except (ValueError, TypeError) as damaged:  # then the configured one is laid out at the next start
        (run / CONFIGURED).unlink(missing_ok=True)
        raise Stop(GIVEN, f"{run / BEFORE}: {damaged}") from None
