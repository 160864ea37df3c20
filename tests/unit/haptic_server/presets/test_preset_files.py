"""Preset files: every byte counts, and whatever happens to a file, what was saved before it is still there."""

import dataclasses
import errno
import hashlib
import json
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haptic_server.presets.preset import Preset, PresetError, checked_name, from_bytes, to_bytes
from haptic_server.presets.store import PresetStore

FIRST = Preset("slow", "roll", "2026-01-01T00:00:00+00:00", {"dv_pls": 0.1, "k_hand": 20.0}, {"dv_pls": 0.2})
SECOND = Preset(
    "slow", "roll", "2026-01-02T00:00:00+00:00", {"dv_pls": 0.15, "k_hand": 30.0}, {"dv_pls": 0.2}
)
_NUMBERS = st.dictionaries(st.text(max_size=20), st.floats(allow_nan=False, allow_infinity=False), max_size=8)


def preset_body(values: bytes, name: bytes = b'"a"') -> bytes:
    """JSON of a preset with these values."""
    return b'{"name":' + name + b',"scene":"b","saved_at":"c","values":' + values + b',"before":{}}'


def with_checksum(body: bytes) -> bytes:
    """A whole file: whoever makes one can make its checksum."""
    return f"drumstick-preset 1 sha256={hashlib.sha256(body).hexdigest()}\n".encode() + body


@given(st.text(max_size=60), st.text(max_size=60), _NUMBERS, _NUMBERS)
def test_what_is_written_is_read(
    name: str, scene: str, values: dict[str, float], before: dict[str, float]
) -> None:
    preset = Preset(name, scene, "now", values, before)
    assert from_bytes(to_bytes(preset)) == preset


def test_no_byte_can_be_missing_changed_or_too_many() -> None:
    whole = to_bytes(FIRST)
    for length in range(len(whole)):
        with pytest.raises(PresetError):
            from_bytes(whole[:length])
    for place in range(len(whole)):
        for bit in range(8):
            flipped = bytearray(whole)
            flipped[place] ^= 1 << bit
            with pytest.raises(PresetError):
                from_bytes(bytes(flipped))
    for more in (b"\n", b"\0", whole):
        with pytest.raises(PresetError):
            from_bytes(whole + more)


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"[]",
        b"3",
        b'{"name": 1}',
        preset_body(b"3"),
        preset_body(b'{"m":' + b"9" * 4000 + b"}"),  # a number that Python reads, and makes no float of
        preset_body(b'{"m":' + b"9" * 5000 + b"}"),
        preset_body(b'{"m":1e999}'),
        preset_body(b'{"m":NaN}'),
        preset_body(b'{"m":true}'),
        preset_body(b'{"m":"0.1"}'),
        preset_body(b'{"m":0.1,"m":0.2}'),
        preset_body(b'{"m":' + b"[" * 100_000),
        preset_body(b'{"\\ud800":0.1}'),
        preset_body(b"{}", name=b"[1]"),
        preset_body(b"{}", name=b'"\\ud800"'),
        preset_body(b"{}", name=b'"' + b"a" * 401 + b'"'),
    ],
)
def test_a_checksum_alone_makes_no_preset(body: bytes) -> None:
    with pytest.raises(PresetError, match="it is no preset") as refused:
        from_bytes(with_checksum(body))
    assert len(str(refused.value)) < 300


@pytest.mark.parametrize("values", [b'{"m":' + b"9" * 4000 + b"}", b'{"\\ud800":0.1}'])
def test_one_file_that_is_no_preset_is_listed_with_its_reason_among_the_others(
    tmp_path: Path, values: bytes
) -> None:
    store = PresetStore(tmp_path)
    folder = store.save(FIRST).parent
    (folder / "bad.preset").write_bytes(with_checksum(preset_body(values)))
    (folder / os.fsdecode(b"\xff.preset")).write_bytes(b"")  # a name that is no text
    large = folder / "large.preset"
    with large.open("wb") as file:
        file.truncate(10**12)  # a hole: no disk has as much
    rows = {row.name: row for row in store.list()}
    assert list(rows) == ["bad", "large", "slow", "\\udcff"]
    assert "it is no preset" in rows["bad"].trouble
    assert "more than 1000000 bytes" in rows["large"].trouble
    assert rows["slow"].trouble == ""
    json.dumps(list(rows.values()), ensure_ascii=False).encode()
    store.save(dataclasses.replace(FIRST, name="large"))
    assert store.load("large").preset.values == FIRST.values


@pytest.mark.parametrize(
    "name", ["", " ", "a/b", "..", ".a", "a.", " a", "a ", "ä", "a" * 61, "a\0b", "a\nb"]
)
def test_a_name_that_no_file_can_have(name: str) -> None:
    with pytest.raises(PresetError, match="letters, digits"):
        checked_name(name)


@pytest.mark.parametrize("name", ["a", "slow roll", "2nd_half-v1.2", "a" * 60])
def test_names(name: str) -> None:
    assert checked_name(name) == name


@pytest.fixture
def store(tmp_path: Path) -> PresetStore:
    return PresetStore(tmp_path / "state")


def test_saved_loaded_listed(store: PresetStore) -> None:
    assert store.list() == []
    assert store.load_last() is None
    place = store.save(FIRST)
    store.save_last(SECOND)
    assert store.load("slow") == (FIRST, "")
    found = store.load_last()
    assert found is not None
    assert found.preset == SECOND
    assert store.list() == [("slow", "roll", FIRST.saved_at, "")]
    assert place.stat().st_mode & 0o077 == 0
    assert place.parent.stat().st_mode & 0o077 == 0


def test_a_damaged_file_falls_back_to_the_version_before(store: PresetStore) -> None:
    store.save(FIRST)
    place = store.save(SECOND)
    whole = place.read_bytes()
    for length in range(len(whole)):
        place.write_bytes(whole[:length])
        preset, note = store.load("slow")
        assert preset == FIRST
        assert "damaged" in note
        assert FIRST.saved_at in note
    for at in range(len(whole)):
        place.write_bytes(whole[:at] + bytes([whole[at] ^ 0x20]) + whole[at + 1 :])
        assert store.load("slow").preset == FIRST
    assert store.list()[0].trouble != ""
    # A new save must not put the damaged file in the place of the good one.
    store.save(SECOND)
    place.unlink()
    assert store.load("slow").preset == FIRST


def test_when_nothing_is_whole(store: PresetStore) -> None:
    place = store.save(FIRST)
    place.write_bytes(b"")
    with pytest.raises(PresetError, match=r"slow\.preset: not a preset"):
        store.load("slow")
    assert "not a preset" in store.list()[0].trouble
    with pytest.raises(PresetError, match="no preset 'fast'"):
        store.load("fast")


class _Crash(BaseException):
    """The power is cut."""


def test_a_power_cut_at_any_step_leaves_one_of_the_two(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = 0
    for cut_at in range(20):
        store = PresetStore(tmp_path / str(cut_at))
        store.save(FIRST)
        steps = 0

        def stumble(name: str, real, cut_at: int = cut_at):
            def call(*args, **kwargs):
                nonlocal steps
                if steps == cut_at:
                    raise _Crash(name)
                steps += 1
                return real(*args, **kwargs)

            return call

        with monkeypatch.context() as patched:
            for name in ("open", "replace", "fsync", "close"):
                patched.setattr(os, name, stumble(name, getattr(os, name)))
            cut = PresetStore(tmp_path / str(cut_at), sync=os.fsync)
            try:
                cut.save(SECOND)
            except _Crash:
                pass
            else:
                break
        assert store.load("slow").preset in (FIRST, SECOND)
        store.save(SECOND)
        assert store.load("slow") == (SECOND, "")
    assert steps >= 5  # as many places where it can be cut: each was


def test_a_full_disk_changes_nothing_and_says_so(tmp_path: Path) -> None:
    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    store = PresetStore(tmp_path)
    store.save(FIRST)
    with pytest.raises(PresetError, match="No space left"):
        PresetStore(tmp_path, sync=full).save(SECOND)
    assert store.load("slow") == (FIRST, "")
    assert [f.name for f in (tmp_path / "presets").iterdir()] == ["slow.preset"]


def test_a_place_that_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("in the way")
    store = PresetStore(tmp_path / "state")
    with pytest.raises(PresetError, match="cannot be written"):
        store.save(FIRST)
    with pytest.raises(PresetError, match="cannot be read"):
        store.list()
    with pytest.raises(PresetError, match="cannot be read"):
        store.load("slow")


def test_a_folder_that_may_not_be_entered_is_said_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As Path.exists does on Python 3.11; root, as whom tests may run, may enter every folder.
    def refuse(path: Path) -> bool:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    monkeypatch.setattr(Path, "exists", refuse)
    with pytest.raises(PresetError, match="cannot be read: Permission denied"):
        PresetStore(tmp_path).load_last()


def test_each_scene_has_its_last_good_set(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    roll, tom = (
        dataclasses.replace(FIRST, scene=scene, values={"m": m}) for scene, m in (("roll", 0.1), ("tom", 0.2))
    )
    store.save_last(roll)
    assert store.load_last("tom") is None
    store.save_last(tom)
    later = dataclasses.replace(tom, values={"m": 0.3})
    store.save_last(later)
    for scene, kept in (("roll", roll), ("tom", later)):
        found = store.load_last(scene)
        assert found is not None
        assert found.preset == kept
    odd = dataclasses.replace(roll, scene="a/b")  # a name that no file can have: the newest only
    store.save_last(odd)
    found = store.load_last("a/b")
    assert found is not None
    assert found.preset == odd
    store.save_last(tom)
    assert store.load_last("a/b") is None


@pytest.mark.timeout(20)
def test_a_pipe_among_the_presets_holds_up_nobody(tmp_path: Path) -> None:
    store = PresetStore(tmp_path)
    saved = store.save(FIRST)
    store.save(SECOND)
    saved.unlink()
    os.mkfifo(saved)
    found = store.load("slow")
    assert found.preset == FIRST
    assert "cannot be read: not a regular file" in found.note
    assert [row.name for row in store.list()] == ["slow"]
    os.mkfifo(tmp_path / "last.preset")
    with pytest.raises(PresetError, match="not a regular file"):
        store.load_last()
    with pytest.raises(PresetError, match="not a regular file"):
        store.save_last(FIRST)
