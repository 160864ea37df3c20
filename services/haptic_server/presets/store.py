"""Presets in a folder: each is written whole or not at all, and the version before it is kept beside it.

Writing waits for the disk (fsync), so it belongs to a thread that may wait. Reading never changes a file.
"""

import errno
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from haptic_server.presets.preset import (
    MAX_BYTES,
    Preset,
    PresetError,
    checked_name,
    from_bytes,
    is_name,
    to_bytes,
)
from realtime.regular_file import read_bytes

_SUFFIX, _BEFORE = ".preset", ".preset.before"
_NAMED = "presets"
_LAST = "last"


class LeftBehind(PresetError):
    """A preset has its new name, and could not be removed under the old one."""


class Found(NamedTuple):
    """A preset that was read; `note` says in words when it is an older version because the newest is damaged."""

    preset: Preset
    note: str


class Listed(NamedTuple):
    """One file of the list; `trouble` is empty when it can be loaded."""

    name: str
    scene: str
    saved_at: str
    trouble: str


class PresetStore:
    """The presets of one rig in `folder`, and its last good set. The folder is made when something is saved."""

    def __init__(self, folder: Path, sync: Callable[[int], None] = os.fsync) -> None:
        self._folder = folder
        self._sync = sync

    def save(self, preset: Preset) -> Path:
        """Keep under its name, instead of what had that name. PresetError when name or place will not do."""
        return self._write(self._folder / _NAMED, checked_name(preset.name), preset)

    def load(self, name: str) -> Found:
        """The preset of that name; PresetError when there is none, or none that is whole."""
        return self._read(self._folder / _NAMED, checked_name(name))

    def rename(self, name: str, new: str) -> Path:
        """Give a preset, and the version before it, another name; cut off between two steps, both names hold it.

        PresetError when there is none, when no version of it is whole, or when the new name is taken; LeftBehind. The
        new name is looked up, then written: of two at once one would be lost, and one thread of the gateway does both.
        """
        folder = self._folder / _NAMED
        if any(os.path.lexists(folder / f"{checked_name(new)}{suffix}") for suffix in (_SUFFIX, _BEFORE)):
            if name != new and self._is_same(name, new):
                raise PresetError(
                    f"there is a preset {new!r} already, the same as {name!r}, as after a rename that was cut off: "
                    "delete one of the two"
                )
            raise PresetError(
                f"there is a preset {new!r} already: choose another name, or delete that one first"
            )
        self.load(name)  # says why when no version is whole
        versions = _whole_versions(folder, name)
        try:
            for suffix, preset in versions:  # the newest first: an older one alone would pass for the preset
                self._put(folder / f"{new}{suffix}", replace(preset, name=new))
        except PresetError:
            self._remove(folder, new)
            raise
        try:
            self._remove(folder, name)
        except PresetError as error:
            raise LeftBehind(
                f"there is a preset {new!r} now, and {name!r} too: {error}; delete one of the two"
            ) from None
        return folder / f"{new}{_SUFFIX}"

    def _is_same(self, name: str, other: str) -> bool:
        try:
            return replace(self.load(name).preset, name=other) == self.load(other).preset
        except PresetError:  # one of them is damaged
            return False

    def delete(self, name: str) -> None:
        """Remove a preset, and the version before it. PresetError when there is none. Cut off, it is whole, or gone."""
        if not self._remove(self._folder / _NAMED, checked_name(name)):
            raise _missing(name, self._folder / _NAMED)

    def list(self) -> list[Listed]:
        """Every preset by name, also those that are damaged."""
        try:
            found = {
                file.name.removesuffix(_BEFORE if file.name.endswith(_BEFORE) else _SUFFIX)
                for file in (self._folder / _NAMED).iterdir()
                if file.name.endswith((_SUFFIX, _BEFORE))
            }
        except FileNotFoundError:
            return []
        except OSError as error:
            raise PresetError(f"{self._folder / _NAMED} cannot be read: {error.strerror}") from None
        return [self._listed(name) for name in sorted(found)]

    def _listed(self, name: str) -> Listed:
        try:
            found = self.load(name)
        except PresetError as error:
            # A file's name need not be text that can be sent.
            readable = name.encode("utf-8", "backslashreplace").decode()
            return Listed(readable, "", "", str(error))
        return Listed(name, found.preset.scene, found.preset.saved_at, found.note)

    def save_last(self, preset: Preset) -> Path:
        """Keep as the last good set. What another scene had there is laid aside under that scene's name."""
        try:
            aside = from_bytes(_content(self._folder / f"{_LAST}{_SUFFIX}"))
        except (PresetError, OSError):
            aside = None  # none, or none that is worth keeping
        if aside is not None and aside.scene != preset.scene and is_name(_last_of(aside.scene)):
            self._write(self._folder, _last_of(aside.scene), aside)
        return self._write(self._folder, _LAST, preset)

    def load_last(self, scene: str | None = None) -> Found | None:
        """The last good set, or that of one scene; None when there never was one, PresetError when none is whole."""
        found = self._found(_LAST)
        if scene is None or (found is not None and found.preset.scene == scene):
            return found
        return self._found(_last_of(scene)) if is_name(_last_of(scene)) else None

    def _found(self, name: str) -> Found | None:
        try:
            if not any((self._folder / f"{name}{suffix}").exists() for suffix in (_SUFFIX, _BEFORE)):
                return None
        except OSError as error:  # a folder that may not be entered
            raise PresetError(f"{self._folder} cannot be read: {error.strerror}") from None
        return self._read(self._folder, name)

    def _write(self, folder: Path, name: str, preset: Preset) -> Path:
        file = folder / f"{name}{_SUFFIX}"
        self._put(file, preset, keep_as=folder / f"{name}{_BEFORE}")
        return file

    def _put(self, file: Path, preset: Preset, keep_as: Path | None = None) -> None:
        """Write a whole file in the place of what is there, which is kept as `keep_as` when it is whole itself."""
        folder, beside = file.parent, file.with_name(f".{file.name}.{os.getpid()}")
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            try:
                descriptor = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
                with os.fdopen(descriptor, "wb") as new:
                    new.write(to_bytes(preset))
                    new.flush()
                    self._sync(new.fileno())
                if keep_as is not None and _is_whole(file):
                    os.replace(file, keep_as)
                os.replace(beside, file)
            except OSError:
                beside.unlink(missing_ok=True)
                raise
            self._sync_names(folder)
        except OSError as error:
            raise PresetError(f"{file} cannot be written: {error.strerror}") from None

    def _remove(self, folder: Path, name: str) -> bool:
        """Remove both versions; False when there was none."""
        removed = False
        # The older one first: left alone, it would be loaded instead.
        for file in (folder / f"{name}{suffix}" for suffix in (_BEFORE, _SUFFIX)):
            try:
                os.unlink(file)
                self._sync_names(folder)
            except FileNotFoundError:
                continue
            except OSError as error:
                raise PresetError(f"{file} cannot be removed: {error.strerror}") from None
            removed = True
        return removed

    def _sync_names(self, folder: Path) -> None:
        # Without it a power cut may bring the old name back. Only POSIX opens a folder.
        if os.name != "posix":
            return
        place = os.open(folder, os.O_RDONLY)
        try:
            self._sync(place)
        finally:
            os.close(place)

    def _read(self, folder: Path, name: str) -> Found:
        troubles: list[str] = []
        for suffix in (_SUFFIX, _BEFORE):
            file = folder / f"{name}{suffix}"
            try:
                preset = from_bytes(_content(file))
            except FileNotFoundError:
                continue
            except OSError as error:
                troubles.append(f"{file} cannot be read: {error.strerror}")
            except PresetError as error:
                troubles.append(f"{file}: {error}")
            else:
                older = f"the version of {preset.saved_at} is used" if suffix == _BEFORE else ""
                return Found(preset, "; ".join([*troubles, older] if older else troubles))
        if troubles:
            raise PresetError("; ".join(troubles))
        raise _missing(name, folder)


def _missing(name: str, folder: Path) -> PresetError:
    return PresetError(f"no preset {name!r} in {folder}")


def _last_of(scene: str) -> str:
    return f"{_LAST} of {scene}"


def _content(file: Path) -> bytes:
    # OSC's thread reads a preset that is loaded: a pipe of that name would hold it up until somebody writes there.
    return read_bytes(file, MAX_BYTES)


def _whole_versions(folder: Path, name: str) -> list[tuple[str, Preset]]:
    versions: list[tuple[str, Preset]] = []
    for suffix in (_SUFFIX, _BEFORE):
        file = folder / f"{name}{suffix}"
        try:
            versions.append((suffix, from_bytes(_content(file))))
        except (FileNotFoundError, PresetError):
            continue
        except OSError as error:  # a disk that fails may hold a whole version all the same
            raise PresetError(f"{file} cannot be read: {error.strerror}") from None
    return versions


def _is_whole(file: Path) -> bool:
    try:
        from_bytes(_content(file))
    except (PresetError, FileNotFoundError):
        return False
    except OSError as error:
        if error.errno != errno.EFBIG:
            raise
        return False
    return True
