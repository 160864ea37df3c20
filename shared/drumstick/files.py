"""Files: scenes found by a shipped name or a path, read, and written; sounds and pictures written. Any thread.

The library does no other I/O.
"""

import warnings
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.scenes.reading import MAX_TEXT
from drumstick.scenes.scene_text import SceneError, parse, shipped_names, shipped_text
from drumstick.scenes.table import Refusal, scene_with
from drumstick.scenes.writing import as_toml
from realtime.regular_file import read_text, write_bytes, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drumstick.public.sound import Sound


class SceneText(NamedTuple):
    """A scene's text and where it came from."""

    text: str
    source: str


def scene_text(scene: str) -> SceneText:
    """The text of a shipped scene or of a file (anything with a / or ending in .toml). Raises SceneError."""
    if scene in shipped_names():
        return SceneText(shipped_text(scene), scene)
    path = Path(scene)
    if not (scene.endswith(".toml") or "/" in scene or path.is_file()):
        near = get_close_matches(scene, shipped_names(), 1)
        meant = f" (did you mean {near[0]!r}?)" if near else ""
        raise SceneError(
            [f"no scene {scene!r}{meant}; shipped: {', '.join(shipped_names())}; or give a .toml file"]
        )
    return SceneText(_read(path), str(path))


def _read(path: Path) -> str:
    try:
        return read_text(path, MAX_TEXT)
    except UnicodeDecodeError as error:
        raise SceneError([f"{path}: not UTF-8 text (byte {error.start}); save it as UTF-8"]) from None
    except OSError as error:
        raise SceneError([f"{path}: cannot be read: {error.strerror}"]) from None


def _text_of(source: str | Path) -> SceneText:
    if isinstance(source, Path):
        return SceneText(_read(source), str(source))
    if any(sign in source for sign in "\n=["):  # no scene's name has them: it is the text itself
        return SceneText(source, "scene")
    return scene_text(source)


def scene(source: str | Path, /, **values: float) -> Scene:
    """Scene by its shipped name, the path of a TOML file, or its TOML text, with some of its values changed.

    values: by wire name (`ds.values` lists them; docs/scenes.md says range and unit), each checked against its range.
    A name with a dot is given as `**{"negative_damping.r": 2.0}`. A path that looks like text, with `=` or `[` in it,
    is given as a `pathlib.Path`. What an older release called otherwise is read with a FutureWarning.

    Raises SceneError with every mistake: file, line, key, value, limit, unit.

    >>> import drumstick as ds
    >>> ds.scene("roll", dv_pls=0.3).effects["pulse"].dv_m_per_s
    0.3
    >>> ds.scene("[stick]\\nm_kg = 0.02").stick.m_kg
    0.02
    >>> ds.scene("roll", dv_pls=99.0)
    Traceback (most recent call last):
        ...
    drumstick.scenes.scene_text.SceneError: dv_pls: 99 m/s is outside 0 .. 10 m/s
    """
    found, notes = _text_of(source), list[str]()
    read = parse(found.text, found.source, notes)
    for note in notes:
        warnings.warn(note, FutureWarning, stacklevel=2)
    try:
        return scene_with(read, values)
    except Refusal as refusal:
        raise SceneError([str(refusal)]) from None


def save(what: "Scene | Sound | Figure", path: str | Path) -> None:
    """Write a scene as TOML, a sound as WAV (16 bit), or what a `.plot()` gave as a picture, and replace the file.

    A scene has every value written out, so that `scene(path)` gives an equal one; a recorded gesture (`[hand]
    gesture_file`) must lie beside it, and is not written. A picture is PNG, SVG or PDF, by the ending. Raises OSError;
    ValueError for an ending that matplotlib does not know.

    >>> import tempfile, pathlib, drumstick as ds
    >>> mine = pathlib.Path(tempfile.mkdtemp()) / "mine.toml"
    >>> ds.save(ds.scene("tom"), mine)
    >>> ds.scene(mine) == ds.scene("tom")
    True
    """
    if isinstance(what, Scene):
        write_text(Path(path), as_toml(what))
    elif isinstance(what, np.ndarray):
        write_bytes(Path(path), what.wav())
    else:
        what.savefig(path)
