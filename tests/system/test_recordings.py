"""Recording a rig that plays: nothing is missing, whatever ends the recorder; and the rig never notices."""

import json
import os
import resource
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest
import zenoh
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader
from recorder_process import Recorder, events
from rig_process import DRUMSTICK, PATIENCE_S, Listener, Rig, ask, is_alive, running, wait_for

from protocol.messages import Contact, Readback, Release, SetReply, State, Strike, decode
from rig.recording import channels
from rig.recording.reading import read
from streamed_engine import streamed_text


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    scene = tmp_path_factory.mktemp("scene") / "streamed.toml"
    scene.write_text(streamed_text(), encoding="utf-8")
    with running("haptic", "--scene", str(scene)) as started:
        yield started


@pytest.mark.real_clock
@pytest.mark.long
def test_ten_seconds_of_a_roll_and_none_is_missing(rig: Rig, session: zenoh.Session, tmp_path: Path) -> None:
    heard = Listener(session, rig.keys.strike, Strike)
    out = tmp_path / "roll.mcap"
    recorder = Recorder(rig, out, "--force", "--duration", "10", "--json")
    recorder.recorded()
    reply = decode(ask(session, rig.keys.set_many, {"dv_pls": 0.21}), SetReply)
    status, told, said = recorder.ended()
    assert (status, said) == (0, "")
    summary = json.loads(told)
    strikes = [s for s in events(out, channels.STRIKE) if isinstance(s, Strike)]
    assert len(strikes) > 150
    assert summary["messages"]["/strike"] == len(strikes)
    assert (summary["end"], summary["lost"], summary["missing"], summary["unreadable"]) == (
        "duration",
        {},
        {},
        0,
    )
    published = {s.seq: s for s in list(heard.got)}
    assert strikes == [published[seq] for seq in range(strikes[0].seq, strikes[-1].seq + 1)]
    assert [event.name for event in read(out).of(channels.PARAM)].count("dv_pls") >= 2
    readbacks = [r for r in events(out, channels.PARAM) if isinstance(r, Readback)]
    assert max(r.revision for r in readbacks) == reply.revision
    _assert_forces_add_up(out, strikes)
    with out.open("rb") as file:  # the library's own reader, by the index
        found = list(make_reader(file, validate_crcs=True).iter_messages(topics="/strike"))
    assert [json.loads(message.data)["seq"] for _, _, message in found] == [s.seq for s in strikes]
    # One machine, one clock: publish_time has the rhythm of t_ns, however unevenly they were heard.
    apart = {message.publish_time - json.loads(message.data)["t_ns"] for _, _, message in found}
    assert max(apart) - min(apart) < 2_000_000
    assert all(message.log_time >= message.publish_time - 1_000_000 for _, _, message in found)


def _assert_forces_add_up(out: Path, strikes: list[Strike]) -> None:
    # Forces are heard last: contacts that had begun by then lack some, and the last ones may have ended after.
    pieces = [p for p in events(out, channels.CONTACT) if isinstance(p, Contact)]
    releases = {r.seq: r for r in events(out, channels.RELEASE) if isinstance(r, Release)}
    since = [strike.seq for strike in strikes if strike.t_ns >= pieces[0].t_ns]
    assert len(since) > 100
    for seq in since[:-2]:
        own = [piece for piece in pieces if piece.seq == seq]
        forces = np.concatenate([np.frombuffer(piece.forces, "<f4") for piece in own]).astype(float)
        assert forces.sum() / own[0].rate_Hz == pytest.approx(releases[seq].impulse_N_s, rel=1e-6)


@pytest.mark.long
def test_without_force_the_rig_streams_nothing_and_the_recorder_is_seen_to_hear_the_rest(
    rig: Rig, session: zenoh.Session, tmp_path: Path
) -> None:
    def wanted() -> bool:
        return bool(json.loads(ask(session, rig.keys.doctor))["contact"]["wanted"])

    wait_for("the stream's end", lambda: not wanted())
    recorder = Recorder(rig, tmp_path / "a.mcap")
    recorder.recorded(8000)
    assert not wanted()
    status, told, _ = recorder.ended(signal.SIGINT)
    assert status == 0
    assert "strikes" in told
    recording = read(tmp_path / "a.mcap")
    assert recording.torn == ""
    assert recording.of(channels.CONTACT) == []
    assert {event.channel for event in recording.events} >= {
        channels.STRIKE, channels.RELEASE, channels.STATE, channels.PARAM, channels.ALIVE,
    }  # fmt: skip
    present = [p for p in events(tmp_path / "a.mcap", channels.ALIVE) if isinstance(p, channels.Presence)]
    assert ("haptic", True) in [(p.service, p.alive) for p in present]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
@pytest.mark.long
@pytest.mark.usefixtures("session")
def test_a_signal_finishes_the_file(rig: Rig, tmp_path: Path, number: signal.Signals) -> None:
    recorder = Recorder(rig, tmp_path / "a.mcap", "--json")
    recorder.recorded(6000)
    status, told, _ = recorder.ended(number)
    assert status == 0
    assert json.loads(told)["end"] == "stopped"
    with (tmp_path / "a.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == sum(json.loads(told)["messages"].values())


def test_killed_it_leaves_what_was_on_the_disk_by_then(
    rig: Rig, session: zenoh.Session, tmp_path: Path
) -> None:
    """A chunk is ended when it is a second old: by a clock that is turned, in tests/unit/rig/recording."""
    heard = Listener(session, rig.keys.strike, Strike)
    out = tmp_path / "a.mcap"
    recorder = Recorder(rig, out)
    recorder.recorded(12_000)  # several chunks
    newest = list(heard.got)[-1].seq

    def is_there() -> bool:
        return any(isinstance(s, Strike) and s.seq >= newest for s in events(out, channels.STRIKE))

    wait_for("what was heard, in the file", is_there)
    assert recorder.ended(signal.SIGKILL)[0] == -signal.SIGKILL
    strikes = [s for s in events(out, channels.STRIKE) if isinstance(s, Strike)]
    assert "was cut off" in read(out).torn
    assert [s.seq for s in strikes] == list(range(strikes[0].seq, strikes[-1].seq + 1))
    assert len(strikes) > 20
    assert strikes[-1].seq >= newest
    # The library's own streaming reader comes as far.
    seen: list[int] = []

    def read_all(file: BinaryIO) -> None:
        for _, _, message in NonSeekingReader(file).iter_messages(topics="/strike", log_time_order=False):
            seen.append(json.loads(message.data)["seq"])

    with out.open("rb") as file, pytest.raises(EndOfFile):
        read_all(file)
    assert seen == [s.seq for s in strikes]


@pytest.mark.long
def test_a_file_that_may_not_grow_ends_the_recording_with_one_line_and_the_rig_plays_on(
    rig: Rig, session: zenoh.Session, tmp_path: Path
) -> None:
    states = Listener(session, rig.keys.state, State)
    recorder = Recorder(rig, tmp_path / "a.mcap")
    size = recorder.recorded(6000)
    resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (size + 3000, size + 3000))
    status, told, said = recorder.ended()
    assert (status, told) == (3, "")
    lines = said.strip().splitlines()
    assert len(lines) == 1
    assert "a.mcap: File too large; the recording ends here, after" in lines[0]
    assert "the rig plays on" in lines[0]
    recording = read(tmp_path / "a.mcap")
    assert "was cut off" in recording.torn
    assert len(recording.of(channels.STRIKE)) > 10
    before = states.got[-1].strikes
    wait_for("more strikes", lambda: states.got[-1].strikes > before + 10)


@pytest.mark.usefixtures("session")
def test_a_full_device_is_refused_at_the_start(rig: Rig, tmp_path: Path) -> None:
    # Not even the header has room.
    recorder = Recorder(rig, tmp_path / "a.mcap")
    resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (100, 100))
    status, _, said = recorder.ended()
    assert status == 3
    assert "a.mcap: cannot be written: File too large" in said
    assert not (tmp_path / "a.mcap").exists()


@pytest.mark.usefixtures("session")
@pytest.mark.long
def test_what_cannot_be_recorded_is_said(rig: Rig, tmp_path: Path) -> None:
    def said(out: str, *options: str) -> tuple[int, str]:
        command = [*DRUMSTICK, "record", "--connect", rig.endpoint, "--rig", rig.name, "--out", out, *options]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        assert "Traceback" not in done.stderr
        return done.returncode, done.stderr

    there = tmp_path / "there.mcap"
    there.write_text("mine")
    assert said(str(there)) == (2, f"drumstick: --out {there}: exists already; recordings are never overwritten: give"
                                " another name\n")  # fmt: skip
    assert there.read_text() == "mine"
    assert said(str(tmp_path / "a.bag"))[0] == 2
    assert said(str(tmp_path / "nowhere" / "a.mcap"))[0] == 2
    status, words = said(str(tmp_path / "a.mcap"), "--rig", "nobody-of-that-name")
    assert (status, "nobody answers" in words) == (3, True)
    status, words = said(str(tmp_path / "a.mcap"), "--connect", "tcp/127.0.0.1:9")
    assert (status, "no rig answers at tcp/127.0.0.1:9" in words) == (3, True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["there.mcap"]


@pytest.mark.long
def test_a_servo_that_is_killed_meanwhile_is_followed(tmp_path: Path) -> None:
    out = tmp_path / "a.mcap"
    with running("haptic") as plain:
        session = plain.client()
        heard = Listener(session, plain.keys.strike, Strike)
        recorder = Recorder(plain, out, "--json")
        recorder.recorded(9000)
        first = heard.got[0].boot
        os.kill(plain.children()["haptic_server.servo"], signal.SIGKILL)
        wait_for("another servo", lambda: heard.got[-1].boot != first)
        before = len(heard.got)
        wait_for("its strikes", lambda: len(heard.got) > before + 300)
        status, told, said = recorder.ended(signal.SIGTERM)
        session.close()
    assert status == 0, said
    assert json.loads(told)["missing"] == {}
    strikes = [(event.publish_ns, decode(event.payload, Strike)) for event in read(out).of(channels.STRIKE)]
    boots = list(dict.fromkeys(strike.boot for _, strike in strikes))
    assert boots == [first, heard.got[-1].boot]
    published = {(strike.boot, strike.seq) for strike in list(heard.got)}
    for boot in boots:
        own = [strike.seq for _, strike in strikes if strike.boot == boot]
        assert own == list(range(own[0], own[-1] + 1))
        assert {(boot, seq) for seq in own[:-2]} <= published
    # The first of the new servo have their arrival's time; then its clock is known, and one machine has one clock.
    apart = [publish_ns - strike.t_ns for publish_ns, strike in strikes]
    assert np.ptp(apart[-30:]) < 1_000_000
    assert apart[-1] == pytest.approx(apart[0], abs=5_000_000)


@pytest.mark.long
def test_presence_is_recorded_as_it_comes_and_goes(tmp_path: Path) -> None:
    out = tmp_path / "a.mcap"
    with running("haptic", "--record", str(out)) as started:
        session = started.client()
        token = session.liveliness().declare_token(started.keys.alive("sound", "mine"))
        wait_for("a recording", lambda: out.exists() and out.stat().st_size > 6_000)
        token.undeclare()
        size = out.stat().st_size
        wait_for("a chunk more", lambda: out.stat().st_size > size + 5_000)
        session.close()
        assert started.stop() == 0
    seen = [
        (p.service, p.id, p.alive) for p in events(out, channels.ALIVE) if isinstance(p, channels.Presence)
    ]
    assert [each for each in seen if each[0] == "sound"] == [
        ("sound", "mine", True),
        ("sound", "mine", False),
    ]
    assert ("haptic", True) in [(service, alive) for service, _, alive in seen]


@pytest.mark.long
def test_force_of_a_scene_that_does_not_stream_is_refused(tmp_path: Path) -> None:
    with running("haptic") as plain:
        plain.client().close()
        recorder = Recorder(plain, tmp_path / "a.mcap", "--force")
        status, _, said = recorder.ended()
    assert status == 2
    assert "does not stream its force" in said
    assert "record without --force" in said
    with running("haptic", "--record", str(tmp_path / "b.mcap"), "--record-force") as refused:
        assert refused.process.wait(PATIENCE_S) == 2
    assert "--record-force: the scene 'roll' does not stream its force" in refused.said
    assert list(tmp_path.iterdir()) == []


def recorder_pid(rig: Rig) -> int:
    return wait_for("the recorder", lambda: rig.children().get("rig.recording"))


def so_far(path: Path, channel: channels.Channel) -> int:
    """Messages of one channel in a file that is still written: each second's are there when it is over."""
    return len(read(path).of(channel)) if path.exists() and path.stat().st_size > 1000 else 0


def others(rig: Rig) -> dict[str, int]:
    """All its processes but the recorder."""
    return {name: pid for name, pid in rig.children().items() if name != "rig.recording"}


@pytest.mark.long
def test_a_rig_that_records_itself_and_a_recorder_that_is_killed(tmp_path: Path) -> None:
    out, second = tmp_path / "up.mcap", tmp_path / "up-2.mcap"
    with running("up", "--record", str(out), "--json") as started:
        session = started.client()
        children = wait_for("all of it", lambda: found if len(found := others(started)) == 4 else None)
        wait_for("a recording", lambda: so_far(out, channels.STRIKE))
        os.kill(recorder_pid(started), signal.SIGKILL)
        wait_for("the sound server's meter in the next file", lambda: so_far(second, channels.METER))
        assert others(started) == children
        wait_for("more strikes", lambda: so_far(second, channels.STRIKE) > 20)
        session.close()
        assert started.stop() == 0
        summary = started.summary()
    assert (summary["restarts"]["record"], summary["recording"]) == (1, str(out))
    assert "[record] recording into " + str(second) in started.said
    assert "was cut off" in read(out).torn
    assert read(second).torn == "", "finished when the rig was stopped"
    strikes = [s.seq for s in events(second, channels.STRIKE) if isinstance(s, Strike)]
    assert strikes == list(range(strikes[0], strikes[-1] + 1))
    assert not any(is_alive(pid) for pid in children.values())


@pytest.mark.long
def test_a_full_disk_is_said_once_and_the_rig_plays_on(tmp_path: Path) -> None:
    out = tmp_path / "full.mcap"
    with running("haptic", "--record", str(out)) as started:
        session = started.client()
        states = Listener(session, started.keys.state, State)
        wait_for("a recording", lambda: out.exists() and out.stat().st_size > 6_000)
        pid, size = recorder_pid(started), out.stat().st_size
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (size + 2000, size + 2000))
        wait_for(
            "its end", lambda: "[record] ended with status 3; the rig plays on without it" in started.said
        )
        before = states.got[-1].strikes
        wait_for("more strikes", lambda: states.got[-1].strikes > before + 40)
        assert started.said.count("File too large") == 1
        assert "rig.recording" not in started.children()
        session.close()
        assert started.stop() == 0
    assert not out.with_name("full-2.mcap").exists()


@pytest.mark.long
def test_up_refuses_a_file_that_is_there_before_anything_starts(tmp_path: Path) -> None:
    there = tmp_path / "there.mcap"
    there.write_text("mine")
    with running("up", "--record", str(there)) as refused:
        assert refused.process.wait(PATIENCE_S) == 2
    assert "exists already" in refused.said
    assert len(refused.said.strip().splitlines()) == 1, refused.said
    assert there.read_text() == "mine"
