"""Preset files that are renamed and deleted: cut off anywhere, no older version passes for the preset."""

import dataclasses
import errno
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from haptic_server.presets.preset import Preset, PresetError
from haptic_server.presets.store import PresetStore

OLDER = Preset("slow", "roll", "2026-01-01T00:00:00+00:00", {"dv_pls": 0.1}, {"dv_pls": 0.2})
NEWEST = dataclasses.replace(OLDER, saved_at="2026-01-02T00:00:00+00:00", values={"dv_pls": 0.15})
STEPS = ("open", "replace", "unlink", "fsync", "close")


class _Crash(BaseException):
    """The power is cut."""


def filled(folder: Path) -> PresetStore:
    """A store with two versions of one preset."""
    store = PresetStore(folder)
    store.save(OLDER)
    store.save(NEWEST)
    return store


def files(folder: Path) -> list[str]:
    return sorted(file.name for file in (folder / "presets").iterdir())


def cut_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, act: Callable[[PresetStore], object]
) -> Iterator[PresetStore]:
    """The store after a power cut before each step of what is done, one after the other."""
    for cut_at in range(100):
        folder = tmp_path / str(cut_at)
        filled(folder)
        left = cut_at

        def stumble(real: Callable[..., object]) -> Callable[..., object]:
            def call(*args: object, **kwargs: object) -> object:
                nonlocal left
                if left == 0:
                    raise _Crash
                left -= 1
                return real(*args, **kwargs)

            return call

        with monkeypatch.context() as patched:
            for name in STEPS:
                patched.setattr(os, name, stumble(getattr(os, name)))
            try:
                act(PresetStore(folder, sync=os.fsync))
            except _Crash:
                pass
            else:
                assert cut_at >= 5  # as many places where it can be cut: each was
                return
        yield PresetStore(folder)
    raise AssertionError("it never came to its end")


def test_a_rename_takes_the_version_before_along(tmp_path: Path) -> None:
    store = filled(tmp_path)
    place = store.rename("slow", "slow roll")
    assert store.load("slow roll") == (dataclasses.replace(NEWEST, name="slow roll"), "")
    assert files(tmp_path) == ["slow roll.preset", "slow roll.preset.before"]
    place.write_bytes(b"")
    found = store.load("slow roll")
    assert found.preset.values == OLDER.values
    assert "is used" in found.note


def test_a_damaged_preset_is_renamed_as_what_is_whole_of_it(tmp_path: Path) -> None:
    store = filled(tmp_path)
    (tmp_path / "presets" / "slow.preset").write_bytes(b"damaged")
    store.rename("slow", "saved")
    assert [(row.name, row.saved_at) for row in store.list()] == [("saved", OLDER.saved_at)]
    assert "is used" in store.list()[0].trouble
    (tmp_path / "presets" / "saved.preset.before").write_bytes(b"damaged")
    with pytest.raises(PresetError, match="damaged"):
        store.rename("saved", "again")
    store.delete("saved")
    assert files(tmp_path) == []


def test_a_version_that_cannot_be_read_is_not_lost_by_a_rename(tmp_path: Path) -> None:
    store = filled(tmp_path)
    newest = tmp_path / "presets" / "slow.preset"
    newest.unlink()
    os.mkfifo(newest)
    with pytest.raises(PresetError, match=r"slow\.preset cannot be read: not a regular file"):
        store.rename("slow", "fast")
    assert files(tmp_path) == ["slow.preset", "slow.preset.before"]


def test_names_that_are_missing_taken_or_no_names(tmp_path: Path) -> None:
    store = filled(tmp_path)
    store.save(dataclasses.replace(OLDER, name="fast"))
    store.save_last(OLDER)
    with pytest.raises(PresetError, match="no preset 'gone'"):
        store.rename("gone", "here")
    with pytest.raises(PresetError, match="no preset 'gone'"):
        store.delete("gone")
    for taken in ("fast", "slow"):
        with pytest.raises(PresetError, match=f"there is a preset '{taken}' already: choose another"):
            store.rename("slow", taken)
    os.replace(tmp_path / "presets" / "fast.preset", tmp_path / "presets" / "fast.preset.before")
    with pytest.raises(PresetError, match="there is a preset 'fast' already"):
        store.rename("slow", "fast")  # of which the newest version is lost
    for wrong in ("", "../last", "a/b", ".slow.1"):
        for act in (
            lambda wrong=wrong: store.rename("slow", wrong),
            lambda wrong=wrong: store.rename(wrong, "new"),
            lambda wrong=wrong: store.delete(wrong),
        ):
            with pytest.raises(PresetError, match="letters, digits"):
                act()
    assert store.load("slow") == (NEWEST, "")
    assert store.load("fast").preset.values == OLDER.values


def test_the_last_good_sets_are_no_presets(tmp_path: Path) -> None:
    store = filled(tmp_path)
    store.save_last(OLDER)
    store.save_last(dataclasses.replace(OLDER, scene="tom"))
    for name in ("last", "last of roll"):
        with pytest.raises(PresetError, match="no preset"):
            store.delete(name)
        with pytest.raises(PresetError, match="no preset"):
            store.rename(name, "mine")
    store.rename("slow", "last")
    store.delete("last")
    for scene in ("roll", "tom"):
        found = store.load_last(scene)
        assert found is not None
        assert found.preset.values == OLDER.values


def test_a_rename_that_is_cut_off_leaves_the_newest_under_each_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for store in cut_off(tmp_path, monkeypatch, lambda store: store.rename("slow", "fast")):
        names = [row.name for row in store.list()]
        assert names in (["slow"], ["fast"], ["fast", "slow"])
        for name in names:
            found = store.load(name)
            assert (found.preset.values, found.note) == (NEWEST.values, "")
        if len(names) == 2:
            with pytest.raises(PresetError, match=r"the same as 'slow', .* cut off: delete one of the two"):
                store.rename("slow", "fast")
        store.delete(names[0])  # which of two is up to the technician
        if not store.list():
            continue
        assert store.load("slow") == (NEWEST, "")
        store.rename("slow", "fast")
        assert store.load("fast").preset.values == NEWEST.values


def test_a_deletion_that_is_cut_off_brings_no_older_version_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for store in cut_off(tmp_path, monkeypatch, lambda store: store.delete("slow")):
        if store.list():
            assert store.load("slow") == (NEWEST, "")
            store.delete("slow")
        assert store.list() == []


def test_a_rename_on_a_full_disk_changes_nothing(tmp_path: Path) -> None:
    filled(tmp_path)
    has_room = iter((True, True, False))  # for the newest version and its name, not for the one before

    def filling(_descriptor: int) -> None:
        if not next(has_room, True):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(PresetError, match=r"fast\.preset\.before cannot be written: No space left"):
        PresetStore(tmp_path, sync=filling).rename("slow", "fast")
    assert files(tmp_path) == ["slow.preset", "slow.preset.before"]
    assert PresetStore(tmp_path).load("slow") == (NEWEST, "")


def test_a_place_that_cannot_be_changed(tmp_path: Path) -> None:
    folder = tmp_path / "presets" / "odd.preset"
    folder.mkdir(parents=True)
    with pytest.raises(PresetError, match=r"odd\.preset cannot be removed"):
        PresetStore(tmp_path).delete("odd")


def test_a_preset_that_is_named_like_a_file_is_listed_once(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    for _ in range(2):
        store.save(dataclasses.replace(NEWEST, name="slow.preset"))
    assert [(row.name, row.trouble) for row in store.list()] == [("slow.preset", "")]
