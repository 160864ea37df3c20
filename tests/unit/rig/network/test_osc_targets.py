"""Two rigs of one machine that send alike to one OSC port: the second one's start says so, and the doctor."""

import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import NoReturn

import pytest

from protocol.keys import Keys
from rig import folder
from rig.machine import doctor
from rig.network import osc_targets
from rig.network.osc_targets import Sender
from rig.replaying import replay
from rig.supervision import service, up
from rig.supervision.parts import HAPTIC
from rig.supervision.plan import Options
from rig.supervision.rig_options import with_free_ports

HERE = "127.0.0.1:9101"
FIRST = Sender("first", (HERE, "10.0.0.2:9000"), "/drumstick")


@pytest.fixture(autouse=True)
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine on which no rig has played yet."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def started(sender: Sender) -> list[str]:
    """Words of the start of this rig, beside a first rig that plays."""
    with osc_targets.publish(folder.run_folder(FIRST.rig), FIRST):
        return list(osc_targets.collisions(sender, osc_targets.playing()))


@pytest.mark.parametrize("target", [HERE, "localhost:9101", "10.0.0.2:9000"])
def test_the_same_port_with_the_same_prefix_is_told(target: str) -> None:
    (words,) = started(Sender("second", ("10.0.0.9:9000", target), "/drumstick"))
    assert words == f"rig 'first' sends OSC to {target} too, with the same prefix /drumstick"


@pytest.mark.parametrize(
    "other",
    [
        Sender("second", ("127.0.0.1:9111",), "/drumstick"),
        Sender("second", ("10.0.0.9:9101",), "/drumstick"),
        Sender("second", FIRST.targets, "/second"),
        Sender("second", (), "/drumstick"),
        Sender("second", ("nowhere", "somewhere:x"), "/drumstick"),
        Sender("first", FIRST.targets, "/drumstick"),
    ],
    ids=["other port", "other host", "other prefix", "no target", "no port", "itself"],
)
def test_what_can_be_told_apart_is_no_collision(other: Sender) -> None:
    assert started(other) == []


def test_a_rig_that_has_ended_sends_nothing() -> None:
    osc_targets.publish(folder.run_folder(FIRST.rig), FIRST).close()
    assert osc_targets.playing() == []


KEPT_OPEN = """
import sys
from rig import folder
from rig.network import osc_targets
kept = osc_targets.publish(folder.run_folder("first"), osc_targets.Sender("first", ("127.0.0.1:9101",), "/drumstick"))
print("published", flush=True)
sys.stdin.read()
"""


def test_a_rig_that_was_killed_sends_nothing() -> None:
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", KEPT_OPEN], stdin=pipe, stdout=pipe) as rig:
        assert rig.stdout is not None
        assert rig.stdout.readline() == b"published\n"
        assert [sender.rig for sender in osc_targets.playing()] == ["first"]
        rig.kill()
    assert osc_targets.playing() == []


def test_run_folders_that_tell_nothing_stop_nobody(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder.run_folder("older")  # of a version that wrote no such file
    folder.run_folder("linked").rmdir()
    (tmp_path / "linked").mkdir()
    folder.run_folder("first").with_name(f"drumstick-{os.getuid()}-linked").symlink_to(tmp_path / "linked")
    strange = folder.run_folder("strange")
    with (
        osc_targets.publish(tmp_path / "linked", Sender("linked", (), "/x")),
        osc_targets.publish(strange, FIRST),
    ):
        assert osc_targets.playing() == [FIRST]
        (strange / osc_targets.FILE).write_text("{}")
        assert osc_targets.playing() == []
    assert str(strange / osc_targets.FILE) in capsys.readouterr().err


def options(rig: str) -> Options:
    run = folder.run_folder(rig)
    parts, router = frozenset({HAPTIC}), "tcp/127.0.0.1:7447"
    return Options(rig, run, run, parts=parts, connect=router, osc_bind=("127.0.0.1", 0))


class _Begun(Exception):
    """Everything before the services is done."""


def _begin(*_: object) -> NoReturn:
    raise _Begun


def test_the_start_of_a_second_rig_with_free_ports_warns_in_one_line_that_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(up, "Rig", _begin)
    monkeypatch.setattr(up, "require_machine", lambda: None)
    monkeypatch.setattr(up, "require_admission", lambda _: None)
    with osc_targets.publish(folder.run_folder(FIRST.rig), FIRST), pytest.raises(_Begun):
        up.up(with_free_ports(options("second")), "roll", None, as_json=False)
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "sends OSC" in line]
    for words in ("'first'", HERE, "/drumstick", "--osc-out HOST:PORT", "--prefix /NAME"):
        assert words in line


def test_a_replay_warns_of_a_rig_that_sends_alike_even_one_of_its_own_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = SimpleNamespace(torn="", scenes=[""])
    monkeypatch.setattr(replay, "load", lambda _: (recording, None))
    monkeypatch.setattr(replay, "_cues", lambda *_: [])
    monkeypatch.setattr(replay, "on_stop_signals", lambda _: None)
    monkeypatch.setattr(replay, "_session", _begin)
    given = replay.ReplayOptions(
        Path("a.mcap"), 1.0, False, False, "tcp/127.0.0.1:0", None, (HERE,), "/drumstick", 60.0
    )
    with osc_targets.publish(folder.run_folder(FIRST.rig), FIRST), pytest.raises(_Begun):
        replay.replay(Keys(FIRST.rig), given, as_json=False)
    assert f"rig 'first' sends OSC to {HERE} too" in capsys.readouterr().err


def test_a_gateway_that_systemd_starts_warns_too_and_is_seen_as_long_as_it_lives(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    second = options("second")
    (second.folder / "scene.toml").touch()
    seen: list[tuple[list[Sender], bool]] = []

    def become(_name: str, given: Options) -> NoReturn:
        inherited = [fd for fd in map(int, os.listdir("/proc/self/fd")) if _is_file_of(fd, given.folder)]
        seen.append((osc_targets.playing(), any(map(os.get_inheritable, inherited))))
        raise _Begun

    monkeypatch.setattr(service, "exec_service", become)
    with osc_targets.publish(folder.run_folder(FIRST.rig), FIRST), pytest.raises(_Begun):
        service.become_gateway(second)
    assert seen == [([FIRST, second.osc_sender], True)]
    assert "'first' sends OSC" in capsys.readouterr().err


def _is_file_of(fd: int, run: Path) -> bool:
    path = Path(f"/proc/self/fd/{fd}")
    return path.exists() and path.samefile(run / osc_targets.FILE)


def test_the_doctor_tells_each_pair_of_rigs_once() -> None:
    assert doctor._osc_targets()[0].good
    with ExitStack() as playing:
        for rig, target in (("a", HERE), ("b", HERE), ("c", "127.0.0.1:9111")):
            sender = Sender(rig, (target,), "/drumstick")
            playing.enter_context(osc_targets.publish(folder.run_folder(rig), sender))
        (found,) = doctor._osc_targets()
    assert not found.good
    assert not found.needed
    assert found.found == f"rig 'a': rig 'b' sends OSC to {HERE} too, with the same prefix /drumstick"
    assert "--osc-out" in found.remedy
