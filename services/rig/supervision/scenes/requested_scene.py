"""The wish for another scene that a gateway left in the run folder: taken up once, and never a reason to end."""

import dataclasses
import shutil
from pathlib import Path

from realtime.regular_file import read_text
from rig import scene_file
from rig.exit_status import CommandError, usage_error
from rig.scene_file import Say, SceneFiles

_MAX_BYTES = 4096  # a scene's name, or the path of its file


def take(run: Path, say: Say, refuse: Say | None = None) -> SceneFiles | None:
    """Take up the scene that was asked for; None where nobody asked, or for nothing that can be played.

    `say` gets the notes of its reader; `refuse`, `say` without one, why there is nothing that can be played.
    """
    from haptic_server import files

    wanted, taken = run / files.WANTED, run / f".{files.WANTED}.taken"
    refuse = refuse or say
    try:
        _remove(taken)
        if wanted.exists():
            # Whoever reads a refusal while a request is there knows that it is about an older one.
            (run / files.REFUSED).unlink(missing_ok=True)
        wanted.replace(taken)  # first of all: a newer wish must not be removed with this one
        name = read_text(taken, _MAX_BYTES)
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        _remove(wanted)
        _remove(taken)
        refuse(f"the request for another scene cannot be read: {error}")
        return None
    _remove(taken)
    try:
        scene, place = _of_set_list(run, name)
        return dataclasses.replace(scene_file.scene_files(scene, say), place=place)
    except CommandError as stop:
        refuse(f"another scene was asked for: {stop}")
        return None


def _of_set_list(run: Path, wish: str) -> tuple[str, int | None]:
    # The scene and the place that is reached with it; one that is asked for by name stands at the present place.
    from haptic_server import set_list

    listed = set_list.read(run)
    if not wish.isdecimal():
        return wish, listed.at if listed else None
    if listed is None or int(wish) >= len(listed.scenes):
        usage_error(f"no number {int(wish) + 1} in the set list")
    return listed.scenes[int(wish)], int(wish)


def clear_leftovers(run: Path) -> None:
    """Remove what a `drumstick up` that was killed left of its set list and of a scene that it made ready.

    A gateway would announce that scene for ever, and step through a list that nobody plays. For the rig's lock holder.
    """
    from haptic_server import files

    shutil.rmtree(run / files.NEXT, ignore_errors=True)
    for name in (files.REFUSED, files.SET_LIST):
        (run / name).unlink(missing_ok=True)


def _remove(wanted: Path) -> None:
    # Whatever lies there: it must not be met again at the next look.
    if wanted.is_dir() and not wanted.is_symlink():
        shutil.rmtree(wanted, ignore_errors=True)
    else:
        wanted.unlink(missing_ok=True)
