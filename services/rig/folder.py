"""A rig's folders: the run folder (scene, block, token; private, in memory where the machine has that), and its state
(presets, the last good set; on disk).
"""

import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from rig.exit_status import CommandError, unavailable

if sys.platform != "win32":
    import fcntl

ON_WINDOWS = (
    "a rig plays on Linux and macOS, here in WSL 2 (docs/install.md); simulate, render and analyse work here"
)


def _places(rig: str) -> Iterator[Path]:
    if sys.platform == "win32":
        return
    for base in (os.environ.get("XDG_RUNTIME_DIR"), "/dev/shm", tempfile.gettempdir()):
        if base and os.access(base, os.W_OK | os.X_OK):
            yield Path(base) / f"drumstick-{os.getuid()}-{rig}"


def found_folder(rig: str) -> Path | None:
    """The folder that `rig` has, or had when it last ran on this machine; makes none."""
    folder = next(_places(rig), None)
    return folder if folder is not None and folder.is_dir() and not folder.is_symlink() else None


def run_folders() -> Iterator[Path]:
    """Run folders of this user's rigs, those that have ended too; what another user put there is left out."""
    place = next(_places("*"), None)
    if place is None:
        return
    for folder in place.parent.glob(place.name):
        try:
            found = folder.lstat()
        except FileNotFoundError:  # removed since it was listed
            continue
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid():
            yield folder


def _states() -> Path:
    base = os.environ.get("XDG_STATE_HOME")
    return Path(base) if base else Path.home() / ".local" / "state"


def state_folder(rig: str) -> Path:
    """Folder of the presets; not made before something is."""
    return _states() / "drumstick" / rig


def accuracy_folder() -> Path:
    """Folder of the newest result of `drumstick accuracy`; not made before there is one."""
    return _states() / "drumstick-accuracy"


def run_folder(rig: str) -> Path:
    """The folder of `rig`, 0700, made when missing. Raises CommandError when it is not ours, and on Windows."""
    if sys.platform == "win32":
        unavailable(ON_WINDOWS)
    folder = next(_places(rig), None)
    if folder is None:
        unavailable("no writable place for run-time files: set XDG_RUNTIME_DIR to a folder of yours")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except FileExistsError:
        unavailable(f"{folder} is in the way and no folder: remove it, or use another --rig")
    except OSError as error:
        unavailable(f"{folder} cannot be made: {error.strerror}; set XDG_RUNTIME_DIR to a folder of yours")
    if found.st_uid != os.getuid() or found.st_mode & 0o077 or not folder.is_dir() or folder.is_symlink():
        unavailable(
            f"{folder} belongs to another user, or others can access it: remove it, or use another --rig"
        )
    return folder


def open_lock(folder: Path) -> IO[str]:
    """The rig's lock, not taken yet. Raises CommandError."""
    try:
        return (folder / "lock").open("w")
    except OSError as error:
        unavailable(f"{folder / 'lock'} cannot be written: {error.strerror}")


def take(lock: IO[str], rig: str) -> None:
    """Hold the rig's lock until the last process that has this file closes it. Raises CommandError when another
    `drumstick` has it."""
    assert sys.platform != "win32"
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        unavailable(
            f"rig {rig!r} is already running on this machine: stop it, or give this one another name with --rig"
        )


def claim(folder: Path, rig: str) -> IO[str]:
    """Hold the rig's lock while the returned file is open. Raises CommandError when another `drumstick` has it."""
    lock = open_lock(folder)
    try:
        take(lock, rig)
    except CommandError:
        lock.close()
        raise
    return lock


def put_text(path: Path, text: str) -> None:
    """Replace a file in one step; Stop when the place is full or read-only."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        unavailable(f"{path} cannot be written: {error.strerror}")
