"""A path that somebody names may be anything: a device that never ends, a pipe that nobody writes into, a folder.

Every reader of a named file refuses it at once, in its own words.
"""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse
from drumstick_lab.accuracy import store
from haptic_server import files
from haptic_server.presets.preset import PresetError
from haptic_server.presets.store import PresetStore
from haptic_server.servo.device import gesture, replay
from haptic_server.servo.device.protocol import DeviceError
from protocol.access.identity import Identity
from rig import last_fault, scene_file
from rig.exit_status import CommandError
from rig.identity import identity_check, keys, rig_file
from rig.offline import render
from rig.recording import reading
from web_panel import accuracy_results
from web_panel.access import visitor_token

_SCENE = '[hand]\ngesture = "recorded"\ngesture_file = "named"\n[device]\nplant = "phantom"\n'


class Reader(NamedTuple):
    """Reader of a file called NAME in a folder; its own error."""

    name: str
    read: Callable[[Path], object]
    error: type[Exception]


def _gesture_beside(path: Path) -> object:
    return scene_file.gesture(str(path.parent / "mine.toml"), parse(_SCENE, "mine.toml"))


def _private(path: Path) -> object:
    if not path.is_symlink():
        path.chmod(0o600)
    return visitor_token.token_of(path)


def _identity(path: Path) -> object:
    return identity_check.require_client(Identity(path, path, path), ("sound",), "sound")


def _huge(path: Path) -> None:
    path.touch()
    os.truncate(path, 2**43)  # a hole, which takes no room


READERS = {
    "a scene": Reader("named.toml", lambda path: scene_file.read(str(path)), CommandError),
    "a gesture beside its scene": Reader("named", _gesture_beside, CommandError),
    "a gesture in the run folder": Reader(
        "named", lambda path: gesture.read(path, Scene("any")), DeviceError
    ),
    "the device replay:FILE": Reader("named", replay.read, DeviceError),
    "a rig file": Reader("named", rig_file.load, CommandError),
    "a recording": Reader("named.mcap", reading.read, reading.RecordingError),
    "strikes": Reader("named", lambda path: render.strikes_of(path, Scene("any")), CommandError),
    "certificates shown": Reader(
        "named.pem", lambda path: keys.show(path.parent, as_json=True), CommandError
    ),
    "one's own certificate": Reader("named", _identity, CommandError),
    "the trace of a fault": Reader(
        files.TRACE, lambda path: last_fault.read(path.parent), last_fault.TraceError
    ),
    "the page's token": Reader("named", _private, visitor_token.TokenFileError),
    "a result of accuracy": Reader("named", accuracy_results.read, ValueError),
    "the last good set": Reader(
        "last.preset", lambda path: PresetStore(path.parent).load_last(), PresetError
    ),
}
KINDS: dict[str, Callable[[Path], object]] = {
    "pipe": os.mkfifo,
    "folder": Path.mkdir,
    "endless": lambda path: path.symlink_to("/dev/zero"),
    "random": lambda path: path.symlink_to("/dev/random"),
    "one that fails when it is read": lambda path: path.symlink_to("/proc/self/mem"),
    "huge": _huge,
}


@pytest.mark.timeout(20)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_file_or_too_large_is_refused_at_once(tmp_path: Path, reader: str, kind: str) -> None:
    name, read, error = READERS[reader]
    (tmp_path / "mine.toml").write_text(_SCENE)
    KINDS[kind](tmp_path / name)
    with pytest.raises(error) as refused:
        read(tmp_path / name)
    assert 0 < len(str(refused.value)) < 1000


@pytest.mark.timeout(20)
def test_a_result_that_is_no_file_is_not_full(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / store.FILE)
    assert not store.is_full(tmp_path)
    (tmp_path / store.FILE).unlink()
    shutil.copyfile(store.FULL, tmp_path / store.FILE)
    assert store.is_full(tmp_path) is not json.loads(store.FULL.read_text())["machine"]["quick"]
