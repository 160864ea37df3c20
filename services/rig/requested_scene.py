"""The wish for another scene that a gateway left in the run folder: taken up once, and never a reason to end."""

import shutil
from pathlib import Path

import msgspec

from realtime.regular_file import read_text
from rig import folder, scene_file
from rig.exit_status import CommandError, usage_error
from rig.scene_file import Say, SceneFiles

_MAX_BYTES = 4096  # a scene's name, or the path of its file


def take(run: Path, say: Say) -> SceneFiles | None:
    """Take up the scene that was asked for; None where nobody asked, or for nothing that can be played (said)."""
    from haptic_server import files

    wanted = run / files.WANTED
    try:
        name = read_text(wanted, _MAX_BYTES)
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        _remove(wanted)
        say(f"another scene was asked for, but not readably: {error}")
        return None
    _remove(wanted)
    try:
        return scene_file.scene_files(_of_set_list(run, name) if name.isdecimal() else name, say)
    except CommandError as stop:
        say(f"another scene was asked for: {stop}")
        return None


def _of_set_list(run: Path, number: str) -> str:
    # That scene, which is the one to go on from now, whether it can be played or not.
    from haptic_server import files, set_list

    listed = set_list.read(run)
    if listed is None or int(number) >= len(listed.scenes):
        usage_error(f"no number {int(number) + 1} in the set list")
    folder.put_text(run / files.SET_LIST, msgspec.structs.replace(listed, at=int(number)).text())
    return listed.scenes[int(number)]


def _remove(wanted: Path) -> None:
    # Whatever lies there: it must not be met again at the next look.
    if wanted.is_dir() and not wanted.is_symlink():
        shutil.rmtree(wanted, ignore_errors=True)
    else:
        wanted.unlink(missing_ok=True)
