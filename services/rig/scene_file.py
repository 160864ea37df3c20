"""Finding a scene by shipped name or file, read and validated, with one clear message otherwise."""

from pathlib import Path
from typing import NamedTuple

from rig.fault import wrong

LARGEST_BYTES = 1_000_000


class SceneText(NamedTuple):
    """A scene's text and where it came from."""

    text: str
    source: str


def read(scene: str) -> SceneText:
    """The text of a shipped scene or of a file (anything with a / or ending in .toml). Raises Stop."""
    from drumstick.scene import shipped_names, shipped_text

    if scene in shipped_names():
        return SceneText(shipped_text(scene), scene)
    path = Path(scene)
    if not (scene.endswith(".toml") or "/" in scene or path.is_file()):
        wrong(f"no scene {scene!r}; shipped: {', '.join(shipped_names())}; or give a .toml file")
    try:
        if path.stat().st_size > LARGEST_BYTES:
            wrong(f"{scene}: {path.stat().st_size} bytes, a scene has at most {LARGEST_BYTES}")
        return SceneText(path.read_text(encoding="utf-8"), str(path))
    except UnicodeDecodeError as error:
        wrong(f"{scene}: not UTF-8 text (byte {error.start}); save it as UTF-8")
    except OSError as error:
        wrong(f"{scene}: cannot be read: {error.strerror}")


def load(scene: str):
    """The validated scene. Raises Stop with every mistake in it."""
    from drumstick.scene import SceneError, parse

    found = read(scene)
    try:
        return parse(found.text, found.source)
    except SceneError as error:
        wrong(str(error))
