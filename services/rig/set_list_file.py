"""A set list: a text file with one scene a line, shipped or a .toml file beside it; # begins a comment."""

from pathlib import Path

from drumstick.scenes.scene_text import shipped_names
from haptic_server.set_list import MAX_SCENES, SetList
from realtime.regular_file import read_text
from rig import scene_file
from rig.exit_status import CommandError, usage_error

_MAX_BYTES = 200_000


def read(path: Path) -> SetList:
    """The set list of this file, each of its scenes read and checked. Raises CommandError with file and line."""
    try:
        lines = read_text(path, _MAX_BYTES).split("\n")
    except OSError as error:
        usage_error(f"{path}: cannot be read: {error.strerror}")
    except UnicodeDecodeError:
        usage_error(f"{path}: not UTF-8 text; give one scene a line")
    scenes: list[str] = []
    for number, line in enumerate(lines, 1):
        name = line.partition("#")[0].strip()
        if not name:
            continue
        where = f"{path}, line {number}"
        if len(scenes) == MAX_SCENES:
            usage_error(f"{where}: more than {MAX_SCENES} scenes")
        scene = name if name in shipped_names() else str((path.parent / name).resolve())
        if scene != name and not name.endswith(".toml"):
            usage_error(
                f"{where}: no scene {name[:80]!r}; shipped: {', '.join(shipped_names())}; or a .toml file"
            )
        try:
            scene_file.scene_files(scene, lambda _: None)
        except CommandError as stop:
            usage_error(f"{where}: {stop}")
        scenes.append(scene)
    if not scenes:
        usage_error(f"{path}: no scene in it; write one a line")
    return SetList(tuple(scenes))
