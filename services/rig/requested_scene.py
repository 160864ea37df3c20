"""The wish for another scene that a gateway left in the run folder: taken up once, and never a reason to end."""

import shutil
from pathlib import Path

from realtime.regular_file import read_text
from rig import scene_file
from rig.exit_status import CommandError
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
        return scene_file.scene_files(name, say)
    except CommandError as stop:
        say(f"another scene was asked for: {stop}")
        return None


def _remove(wanted: Path) -> None:
    # Whatever lies there: it must not be met again at the next look.
    if wanted.is_dir() and not wanted.is_symlink():
        shutil.rmtree(wanted, ignore_errors=True)
    else:
        wanted.unlink(missing_ok=True)
