"""Undo, redo, A and B in a file of the rig's folder, so that they outlive a panel that fell. Main thread.

Waits for the disk only. A file that is not as we write it is as none, with a line in the log.
"""

import hashlib
import json
import logging
import os
from pathlib import Path
from typing import cast

from drumstick.parameters.scene import Scene
from realtime.regular_file import read_text, write_text
from web_panel.tuning.compare import SLOTS, Compare
from web_panel.tuning.undo import MAX_STEPS, Step, UndoHistory

_MAX_BYTES = 1_000_000
_log = logging.getLogger("panel")


class NotOurs(ValueError):
    """The file holds something else; the message says what."""


class UndoFile:
    """The file at `path`, of one scene at a time."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self, scene: Scene) -> tuple[UndoHistory, Compare]:
        """Read what was kept of this scene; empty when nothing was, or another scene's."""
        try:
            return _read(self._path, scene)
        except FileNotFoundError:
            pass
        except (OSError, UnicodeDecodeError, ValueError, RecursionError) as error:
            _log.warning("%s is not used: %s", self._path, error)
        return UndoHistory(), Compare()

    def write(self, scene: Scene, history: UndoHistory, compare: Compare) -> None:
        """Keep these: the whole file or nothing of it. What cannot be written is one line in the log."""
        content = {
            "scene": _mark(scene),
            "back": [[step.before, step.after] for step in history.back],
            "forth": [[step.before, step.after] for step in history.forth],
            "slots": compare.slots,
            "on": compare.on,
        }
        draft = self._path.with_name(f".{self._path.name}")
        try:
            write_text(draft, json.dumps(content, allow_nan=False))
            os.replace(draft, self._path)
        except OSError as error:
            _log.warning("%s cannot be written: %s", self._path, error.strerror)


def _mark(scene: Scene) -> str:
    # Of all that the scene says: under the same name there may be another.
    return hashlib.sha256(repr(scene).encode()).hexdigest()[:16]


def _read(path: Path, scene: Scene) -> tuple[UndoHistory, Compare]:
    found = _object(json.loads(read_text(path, _MAX_BYTES)))
    if found.get("scene") != _mark(scene):
        return UndoHistory(), Compare()
    slots = {slot: _values(values) for slot, values in _object(found.get("slots")).items() if slot in SLOTS}
    on = found.get("on")
    compare = Compare(slots, on if isinstance(on, str) and on in slots else "")
    return UndoHistory(_steps(found.get("back")), _steps(found.get("forth"))), compare


def _object(found: object) -> dict[str, object]:
    if not isinstance(found, dict):
        raise NotOurs(f"{str(found)[:40]!r} is no object")
    return cast(dict[str, object], found)


def _values(found: object) -> dict[str, float]:
    values: dict[str, float] = {}
    for name, value in _object(found).items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1e12:
            raise NotOurs(f"{name}: {str(value)[:40]} is no number of ours")
        values[name] = float(value)
    return values


def _step(found: object) -> Step:
    before, after = (_values(each) for each in _list(found, 2))
    if before.keys() != after.keys():
        raise NotOurs("a step has other values before than after")
    return Step(before, after)


def _steps(found: object) -> list[Step]:
    return [_step(each) for each in _list(found, MAX_STEPS)]


def _list(found: object, most: int) -> list[object]:
    if not isinstance(found, list) or len(cast(list[object], found)) > most:
        raise NotOurs(f"{str(cast(object, found))[:40]!r} is no list of at most {most}")
    return cast(list[object], found)
