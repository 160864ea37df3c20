"""Presets, the last good set and the writer's lease, on a rig of real processes."""

import json
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest
import zenoh
from osc_port import OscPort
from rig_process import DRUMSTICK, PATIENCE_S, Listener, Rig, ask, reason_of, reply_to, running, wait_for

from protocol.messages import (
    Lease,
    LeaseRequest,
    PresetNews,
    PresetReply,
    Readback,
    SetReply,
    decode,
    encode,
)


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("haptic", "--scene", "roll") as started:
        yield started


def value_of(session: zenoh.Session, rig: Rig, name: str) -> float:
    return decode(ask(session, rig.keys.param(name)), Readback).value


def refusal(session: zenoh.Session, key: str, payload: object) -> str:
    return reason_of(reply_to(session, key, msgspec.msgpack.encode(payload)))


def drumstick(rig: Rig, *words: str) -> subprocess.CompletedProcess[str]:
    command = [*DRUMSTICK, *words, "--rig", rig.name, "--connect", rig.endpoint]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)


def test_saved_and_loaded_over_every_wire(rig: Rig, session: zenoh.Session, osc: OscPort) -> None:
    news = Listener(session, rig.keys.preset, PresetNews)
    ask(session, rig.keys.set_many, {"dv_pls": 0.31, "k_hand": 31.0})
    assert decode(ask(session, rig.keys.preset_save, "by zenoh"), PresetNews).name == "by zenoh"
    ask(session, rig.keys.set_many, {"dv_pls": 0.22, "k_hand": 22.0})
    saved = drumstick(rig, "preset", "save", "by command")
    assert saved.returncode == 0, saved.stderr

    loaded = decode(ask(session, rig.keys.preset_load, "by zenoh"), PresetReply)
    assert (loaded.values["dv_pls"], loaded.values["k_hand"], loaded.note) == (0.31, 31.0, "")
    wait_for("the readback", lambda: value_of(session, rig, "dv_pls") == 0.31)

    told = drumstick(rig, "preset", "load", "by command", "--json")
    assert json.loads(told.stdout)["values"]["k_hand"] == 22.0
    wait_for("the readback", lambda: value_of(session, rig, "k_hand") == 22.0)

    osc.send("/drumstick/preset/load", "by zenoh")
    # Each load is told, the two before as well.
    assert [osc.receive("/drumstick/preset") for _ in range(3)] == [
        ["by zenoh"],
        ["by command"],
        ["by zenoh"],
    ]
    wait_for("the readback", lambda: value_of(session, rig, "k_hand") == 31.0)

    listed = json.loads(drumstick(rig, "preset", "list", "--json").stdout)["presets"]
    assert [(row["name"], row["scene"], row["trouble"]) for row in listed] == [
        ("by command", "roll", ""),
        ("by zenoh", "roll", ""),
    ]
    assert [row["name"] for row in json.loads(ask(session, rig.keys.preset))] == ["by command", "by zenoh"]
    wait_for(
        "the news", lambda: [n.what for n in news.got] == ["saved", "saved", "loaded", "loaded", "loaded"]
    )


def test_renamed_and_deleted_and_everybody_hears_of_it(rig: Rig, session: zenoh.Session) -> None:
    for name in ("to be renamed", "by zenoh"):
        ask(session, rig.keys.preset_save, name)
    names = {row["name"] for row in json.loads(ask(session, rig.keys.preset))}
    news = Listener(session, rig.keys.preset, PresetNews)
    renamed = drumstick(rig, "preset", "rename", "to be renamed", "to be deleted")
    assert renamed.returncode == 0, renamed.stderr
    assert renamed.stdout == "preset to be renamed is now called to be deleted\n"
    for words, why in (
        (("rename", "to be renamed", "anew"), "no preset 'to be renamed'"),
        (("rename", "to be deleted", "by zenoh"), "there is a preset 'by zenoh' already"),
        (("delete", "last"), "no preset 'last'"),
        (("delete", "../last"), "letters, digits"),
    ):
        refused = drumstick(rig, "preset", *words)
        assert (refused.returncode, why in refused.stderr) == (2, True), refused.stderr
    deleted = drumstick(rig, "preset", "delete", "to be deleted")
    assert deleted.stdout == "preset to be deleted deleted on the haptic machine\n", deleted.stderr
    left = {row["name"] for row in json.loads(ask(session, rig.keys.preset))}
    assert left == names - {"to be renamed"}
    wait_for(
        "the news",
        lambda: (
            [(n.what, n.name, n.before) for n in news.got]
            == [("renamed", "to be deleted", "to be renamed"), ("deleted", "to be deleted", "")]
        ),
    )


def test_what_cannot_be_loaded_changes_nothing(rig: Rig, session: zenoh.Session, osc: OscPort) -> None:
    before = value_of(session, rig, "dv_pls")
    assert "no preset 'nowhere'" in refusal(session, rig.keys.preset_load, [1, "nowhere"])
    assert "letters, digits" in refusal(session, rig.keys.preset_load, [1, "../last"])
    assert "letters, digits" in refusal(session, rig.keys.preset_save, [1, "a/b"])
    assert "expected a name" in refusal(session, rig.keys.preset_load, [1, 3])
    osc.send("/drumstick/preset/load", "nowhere")
    address, why = osc.receive("/drumstick/error")
    assert address == "/drumstick/preset/load"
    assert "no preset 'nowhere'" in str(why)
    wrong = drumstick(rig, "preset", "load", "nowhere")
    assert wrong.returncode == 2
    assert "no preset 'nowhere'" in wrong.stderr
    assert value_of(session, rig, "dv_pls") == before


@contextmanager
def renewed(renew: Callable[[], object]) -> Iterator[None]:
    """A lease renewed each second: a command may take longer to start than any lease lasts."""
    done = threading.Event()

    def again() -> None:
        while not done.wait(1.0):
            renew()

    renewing = threading.Thread(target=again)
    renew()
    renewing.start()
    try:
        yield
    finally:
        done.set()
        renewing.join()


def test_one_technician_at_a_time(rig: Rig, session: zenoh.Session, osc: OscPort) -> None:
    shown = Listener(session, rig.keys.lease, Lease)
    other = rig.client()
    assert decode(ask(other, rig.keys.lease), Lease) == Lease(name="", left_s=0.0)
    request = encode(LeaseRequest(who="my secret", name="Ada", seconds=5.0))
    reply = reply_to(session, rig.keys.lease, request)
    assert reply.ok is not None
    assert decode(reply.ok.payload.to_bytes(), Lease).name == "Ada"
    wait_for("the others to see it", lambda: shown.got and shown.got[-1].name == "Ada")
    assert osc.receive("/drumstick/lease", "Ada")

    before = value_of(session, rig, "dv_pls")
    with renewed(lambda: reply_to(session, rig.keys.lease, request)):
        assert "Ada is tuning" in refusal(other, rig.keys.set_one("dv_pls"), [1, 0.27])
        assert "Ada is tuning" in refusal(other, rig.keys.set_many, [1, {"dv_pls": 0.27}, {"lease": "Ada"}])
        assert "Ada is tuning" in refusal(other, rig.keys.preset_load, [1, "by zenoh"])
        assert "Ada is tuning" in refusal(other, rig.keys.preset_rename, [1, ["by zenoh", "mine"]])
        assert "Ada is tuning" in refusal(other, rig.keys.preset_delete, [1, "by zenoh"])
        osc.send("/drumstick/param/dv_pls", 0.27)
        assert "Ada is tuning" in str(osc.receive("/drumstick/error")[1])
        refused = drumstick(rig, "params", "set", "dv_pls=0.27")
    assert (refused.returncode, "Ada is tuning" in refused.stderr) == (2, True)
    assert value_of(session, rig, "dv_pls") == before

    payload = msgspec.msgpack.encode([1, 0.28, {"lease": "my secret"}])
    reply = reply_to(session, rig.keys.set_one("dv_pls"), payload)
    assert reply.ok is not None
    assert decode(reply.ok.payload.to_bytes(), Readback).value == 0.28
    wait_for("its end", lambda: shown.got[-1].name == "")
    ask(other, rig.keys.set_many, {"dv_pls": 0.27})
    other.close()


def test_the_lease_by_osc(rig: Rig, session: zenoh.Session, osc: OscPort) -> None:
    osc.send("/drumstick/lease", "desk")
    # The answer, or what everybody is told a moment later: whichever a busy machine sends first.
    _, left_s = osc.receive("/drumstick/lease", "desk")
    assert 0.0 < float(str(left_s)) <= 5.0
    with renewed(lambda: osc.send("/drumstick/lease", "desk")):
        wait_for("the lease", lambda: decode(ask(session, rig.keys.lease), Lease).name == "desk")
        assert "desk is tuning" in refusal(session, rig.keys.set_one("dv_pls"), [1, 0.3])
        osc.send("/drumstick/param/dv_pls", 0.29)
        assert osc.receive("/drumstick/param/dv_pls", 0.29)
    osc.send("/drumstick/lease", "")
    wait_for("its end", lambda: decode(ask(session, rig.keys.lease), Lease).name == "")
    ask(session, rig.keys.set_many, {"dv_pls": 0.3})


def test_a_set_for_an_older_revision_is_refused(rig: Rig, session: zenoh.Session) -> None:
    seen = decode(ask(session, rig.keys.set_many, {"dv_pls": 0.25}), SetReply).revision
    newer = decode(ask(session, rig.keys.set_many, {"k_hand": 25.0}), SetReply).revision
    key = rig.keys.set_one("dv_pls")
    assert f"somebody made it {newer}" in refusal(session, key, [1, 0.26, {"revision": seen}])
    payload = msgspec.msgpack.encode([1, 0.26, {"revision": newer}])
    assert reply_to(session, key, payload).ok is not None


def test_a_panic_needs_no_lease(session: zenoh.Session, rig: Rig) -> None:
    request = encode(LeaseRequest(who="my secret", name="Ada"))
    assert reply_to(session, rig.keys.lease, request).ok is not None
    with rig_to_panic(rig) as other:
        ask(other, rig.keys.panic)


class rig_to_panic:  # noqa: N801
    """Another session, and the rig armed again afterwards."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    def __enter__(self) -> zenoh.Session:
        self._session = self._rig.client()
        return self._session

    def __exit__(self, *_: object) -> None:
        self._session.close()
        subprocess.run([*DRUMSTICK, "arm", "--rig", self._rig.name], check=True, timeout=PATIENCE_S)


def _power_cut(rig: Rig) -> None:
    # Everything at once, as when the plug is pulled; only what is on the disk is left.
    for pid in [rig.process.pid, *rig.children().values()]:
        os.kill(pid, signal.SIGKILL)
    rig.process.wait()


@pytest.mark.long
def test_a_power_cut_loses_nothing_that_was_set(tmp_path: Path) -> None:
    state = tmp_path / "state"
    with running("haptic", "--scene", "roll", state=state) as rig:
        session = rig.client()
        ask(session, rig.keys.set_many, {"dv_pls": 0.33, "k_hand": 33.0})
        last = state / "drumstick" / rig.name / "last.preset"
        wait_for("it to be kept", lambda: last.exists() and b"0.33" in last.read_bytes())
        session.close()
        _power_cut(rig)
        name = rig.name
    with running("haptic", "--scene", "roll", state=state, name=name) as rig:
        session = rig.client()
        wait_for("the last good set", lambda: value_of(session, rig, "dv_pls") == 0.33)
        assert value_of(session, rig, "k_hand") == 33.0
        wait_for("a line about it", lambda: "--fresh" in rig.said)
        assert "k_hand 33, dv_pls 0.33" in rig.said
        session.close()
    with running("haptic", "--scene", "roll", "--fresh", state=state, name=name) as rig:
        session = rig.client()
        assert value_of(session, rig, "dv_pls") == 0.2
        session.close()
    last.write_bytes(last.read_bytes()[:-1])
    (last.parent / "last.preset.before").unlink(missing_ok=True)
    with running("haptic", "--scene", "roll", state=state, name=name) as rig:
        session = rig.client()
        assert value_of(session, rig, "dv_pls") == 0.2
        wait_for("a line about it", lambda: "checksum does not fit" in rig.said)
        session.close()


@pytest.mark.long
def test_another_scene_starts_as_it_is_written(tmp_path: Path) -> None:
    state = tmp_path / "state"
    with running("haptic", "--scene", "roll", state=state) as rig:
        session = rig.client()
        ask(session, rig.keys.set_many, {"dv_pls": 0.33})
        name = rig.name
        session.close()
    with running("haptic", "--scene", "tom", state=state, name=name) as rig:
        session = rig.client()
        first = value_of(session, rig, "dv_pls")
        assert first != 0.33
        session.close()
    assert not (state / "drumstick" / name / "presets").exists()


@pytest.mark.long
def test_a_place_that_cannot_be_written_stops_no_play(tmp_path: Path) -> None:
    state = tmp_path / "state"
    state.write_text("no folder")
    with running("haptic", "--scene", "roll", state=state) as rig:
        session = rig.client()
        assert "cannot be written" in refusal(session, rig.keys.preset_save, [1, "slow"])
        assert decode(ask(session, rig.keys.set_many, {"dv_pls": 0.3}), SetReply).values == {"dv_pls": 0.3}
        wait_for("a line about it", lambda: "the last good set is not kept" in rig.said)
        session.close()
        assert rig.stop() == 0
