"""A recording played again: a real sound server sounds from it, programs hear it, and it answers as a rig does."""

import json
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np
import pytest
import zenoh
from haptic_side import drum, sounding
from pythonosc.osc_message import OscMessage
from rig_process import DRUMSTICK, Listener, ask, reason_of, replies, reply_to, running, wait_for
from wav_heard import RATE, onsets_s, sound_in

from drumstick.drum.calibrate import strike_for_speed
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables
from protocol.keys import Keys
from protocol.messages import Clock, Contact, Meter, Readback, State, Strike, decode
from protocol.session import client_config
from recordings import a_release, a_state, a_strike, made
from streamed_engine import streamed


class Replay:
    """A real `drumstick replay` at a port of its own."""

    def __init__(self, path: Path, port: int, osc_port: int, *options: str, connect: bool = False) -> None:
        self.endpoint = f"tcp/127.0.0.1:{port}"
        self.keys = Keys("main")
        wire = ["--connect" if connect else "--listen", self.endpoint, "--osc-out", f"127.0.0.1:{osc_port}"]
        self.process = subprocess.Popen(
            [*DRUMSTICK, "replay", str(path), *wire, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def client(self) -> zenoh.Session:
        def opened() -> zenoh.Session | None:
            assert self.process.poll() is None, self.process.communicate()
            try:
                return zenoh.open(client_config(self.endpoint))
            except zenoh.ZError:
                return None

        session = wait_for("the replay's router", opened)
        wait_for("its answer", lambda: replies(session, self.keys.clock))
        return session

    def ended(self, number: signal.Signals | None = None) -> tuple[int, str, str]:
        if number is not None:
            self.process.send_signal(number)
        told, said = self.process.communicate(timeout=90)
        return self.process.returncode, told, said

    def summary(self) -> dict[str, object]:
        status, told, said = self.ended()
        assert status == 0, said
        return json.loads(told)


@contextmanager
def replaying(
    path: Path, *options: str, port: int, osc_port: int = 9, connect: bool = False
) -> Iterator[Replay]:
    replay = Replay(path, port, osc_port, *options, connect=connect)
    try:
        yield replay
    finally:
        if replay.process.poll() is None:
            replay.process.kill()
        replay.process.communicate()


# The rhythm of a recording with a gap, a flam of 0.19 s and a servo that started anew in between.
AT_S = np.cumsum([0.4, 0.31, 0.27, 0.19, 0.35, 0.29, 0.9, 0.33])
FIRST_SEQ = 40


def a_roll(path: Path, scene: Scene, finished: bool = True) -> Path:
    """Strikes at AT_S with their releases, readbacks and states, some of them of another boot."""
    messages = [(0.0, "/param/k_coll", Readback(value=1000.0, revision=3))]
    for k, at_s in enumerate(AT_S):
        boot, seq = (7, k + FIRST_SEQ) if k < 5 else (8, k - 4)
        blow = strike_for_speed(scene, 0.6, 0.4, 0.1)
        strike = a_strike(seq, boot, blow.peak_N, contact_estimate_s=blow.contact_s)
        messages += [(at_s, "/strike", strike), (at_s + 0.0054, "/release", a_release(seq, boot))]
        messages += [(at_s + 0.02, "/state", a_state(seq, boot))]
    return made(path, messages, scene, finished)


@pytest.mark.real_clock
@pytest.mark.long
def test_a_real_sound_server_sounds_from_it_each_strike_once_in_the_recorded_rhythm(
    free_port: Callable[[], int], tmp_path: Path
) -> None:
    recorded = a_roll(tmp_path / "a.mcap", drum(latency_s=0.5, t60_s=0.1))
    late, tries = 1, 0
    while late:  # once more where the machine stood still for half a second, and a strike came too late
        tries += 1
        wav = tmp_path / f"{tries}.wav"
        last, summary = _sounded(recorded, wav, free_port(), tmp_path)
        late = last.late
    assert (last.played, last.duplicates, last.refused) == (len(AT_S), 0, 0)
    assert summary["messages"] == {"/param": 1, "/release": 8, "/state": 8, "/strike": 8}
    assert (summary["end"], summary["passes"], summary["torn"]) == ("done", 1, None)
    found = onsets_s(sound_in(wav), 0.16)
    assert len(found) == len(AT_S)
    # Replay and sound run on one machine's clock, whatever the round trips take.
    assert np.diff(found) == pytest.approx(np.diff(AT_S), abs=1e-3)


def _sounded(recorded: Path, wav: Path, port: int, folder: Path) -> tuple[Meter, dict[str, object]]:
    # The last meter, and the replay's summary.
    with (
        sounding(f"tcp/127.0.0.1:{port}", f"wav:{wav}", folder) as sound,
        replaying(recorded, "--await-sound", "--json", "--rig", "main", port=port) as replay,
    ):
        session = replay.client()
        meters = Listener(session, replay.keys.meter, Meter)
        last = wait_for(
            "all strikes", lambda: next((m for m in meters.got if m.played + m.late == len(AT_S)), None)
        )
        session.close()
        summary = replay.summary()
        # The last one is due half a second after its message, and rings.
        written = len(sound_in(wav))
        wait_for("the last one's sound in the file", lambda: len(sound_in(wav)) > written + 1.2 * RATE)
        sound.stop(signal.SIGTERM)
    return last, summary


@pytest.mark.long
def test_a_scene_that_streams_sounds_by_the_recorded_forces(
    free_port: Callable[[], int], tmp_path: Path
) -> None:
    messages = []
    for seq in range(1, 6):
        for k in range(3):
            forces = np.array([1.0, 2.0] if k < 2 else [1.0, 0.0], "<f4").tobytes()
            tick = 300 * seq + 2 * k
            piece = Contact(
                boot=7, seq=seq, first_tick=tick, rate_Hz=1000.0, forces=forces, t_ns=tick * 10**6, x=0.3, y=0
            )
            messages.append((tick / 1000.0, "/contact", piece))
        messages.append((0.3 * seq, "/strike", a_strike(seq)))
    recorded = made(tmp_path / "a.mcap", messages, streamed(latency_s=0.3))
    port = free_port()
    with (
        sounding(f"tcp/127.0.0.1:{port}", "null", tmp_path),
        replaying(recorded, "--await-sound", "--json", "--loop", port=port) as replay,
    ):
        session = replay.client()
        meters = Listener(session, replay.keys.meter, Meter)
        last = wait_for("two passes", lambda: next((m for m in meters.got if m.played >= 10), None))
        session.close()
        assert (last.duplicates, last.refused) == (0, 0), "the second pass has numbers of its own"
        assert last.peak_left > 1e-4
        status, told, _ = replay.ended(signal.SIGTERM)
    assert (status, json.loads(told)["end"]) == (0, "stopped")
    assert json.loads(told)["messages"]["/contact"] >= 30


def test_it_answers_as_a_rig_does_and_panic_ends_it(free_port: Callable[[], int], tmp_path: Path) -> None:
    scene = drum()
    recorded = a_roll(tmp_path / "a.mcap", scene)
    begun_ns = time.monotonic_ns()
    with replaying(recorded, "--loop", "--json", port=free_port()) as replay:
        session, keys = replay.client(), replay.keys
        strikes, states = Listener(session, keys.strike, Strike), Listener(session, keys.state, State)
        assert json.loads(ask(session, keys.scene)) == json.loads(json.dumps(as_tables(scene)))
        wait_for("nine strikes", lambda: len(strikes.got) >= 9)
        seqs = [strike.seq for strike in list(strikes.got)]
        assert seqs == list(range(seqs[0], seqs[0] + len(seqs)))
        newest = strikes.got[-1]  # before the clock is asked, which another strike may overtake
        clock = decode(ask(session, keys.clock), Clock)
        assert {strike.boot for strike in strikes.got} == {clock.boot}
        assert begun_ns < newest.t_ns <= clock.t_ns < time.monotonic_ns(), "the times of this machine's clock"
        alive = [str(r.ok.key_expr) for r in session.liveliness().get(keys.alive("haptic", "*")) if r.ok]
        assert alive == [keys.alive("haptic", f"{clock.boot:x}")]
        assert decode(ask(session, keys.param("k_coll")), Readback).value == 1000.0
        for key, payload in (
            (keys.set_many, {"k_coll": 0.3}),
            (keys.set_one("k_coll"), 0.3),
            (keys.param("x"), None),
        ):
            encoded = msgspec.msgpack.encode([1, payload])
            reason = reason_of(reply_to(session, key, encoded))
            assert ("a replay of a.mcap: nothing can be set" if payload else "it has k_coll") in reason
        assert json.loads(ask(session, keys.doctor)) == {"replay": str(recorded)}
        ask(session, keys.panic)
        status, told, _ = replay.ended()
        assert status == 0
        assert json.loads(told)["end"] == "panic"
        wait_for("the last state", lambda: states.got[-1:] and states.got[-1].status == "panic")
        # A slow machine may have come to listen after the first ones; they are counted on from there. States and
        # strikes come by threads of their own.
        made = json.loads(told)["messages"]["/strike"]
        wait_for("the last strike", lambda: len(strikes.got) + strikes.got[0].seq - FIRST_SEQ >= made)
        assert len(strikes.got) + strikes.got[0].seq - FIRST_SEQ == made
        session.close()


@pytest.mark.parametrize("by_panic", [True, False])
@pytest.mark.long
def test_waiting_for_a_sound_server_can_be_ended(
    free_port: Callable[[], int], tmp_path: Path, by_panic: bool
) -> None:
    recorded = a_roll(tmp_path / "a.mcap", drum())
    with replaying(recorded, "--await-sound", "--json", port=free_port()) as replay:
        session = replay.client()
        strikes = Listener(session, replay.keys.strike, Strike)
        if by_panic:
            ask(session, replay.keys.panic)
        status, told, said = replay.ended(None if by_panic else signal.SIGINT)
        session.close()
    assert (status, json.loads(told)["end"]) == (0, "panic" if by_panic else "stopped")
    assert "waiting for a sound server of rig 'main'" in said
    assert strikes.got == []


def _osc(receiver: socket.socket, until: Callable[[], bool]) -> list[tuple[str, list[object]]]:
    receiver.settimeout(0.2)
    found: list[tuple[str, list[object]]] = []
    while True:
        is_over = until()  # asked first: what was sent before is in the socket then
        try:
            message = OscMessage(receiver.recv(2048))
        except TimeoutError:
            if is_over:
                return found
            continue
        found.append((message.address, list(message.params)))


@pytest.mark.long
def test_its_osc_is_the_live_rigs(free_port: Callable[[], int], tmp_path: Path) -> None:
    recorded = a_roll(tmp_path / "a.mcap", drum())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        options = ("--prefix", "/mine", "--speed", "2", "--json")
        with replaying(recorded, *options, port=free_port(), osc_port=receiver.getsockname()[1]) as replay:
            ended = threading.Event()
            waiting = threading.Thread(target=lambda: (replay.process.wait(60), ended.set()))
            waiting.start()
            found = _osc(receiver, ended.is_set)
            waiting.join()
            summary = replay.summary()
    told = {address: [args for a, args in found if a == address] for address, _ in found}
    assert [args[0] for args in told["/mine/strike"]] == [40, 41, 42, 43, 44, 45, 46, 47]
    assert told["/mine/strike"][0][1:] == pytest.approx([0.4, 0.1, 0.56, 0.28, told["/mine/strike"][0][5]])
    assert [len(told[f"/mine/{one}"]) for one in ("level", "x", "y", "release")] == [8, 8, 8, 8]
    assert [args[0] for args in told["/mine/gate"]] == [1, 0] * 8
    assert told["/mine/param/k_coll"] == [[1000.0]]
    assert told["/mine/param/k_coll/norm"] == [pytest.approx([0.5])]
    assert told["/mine/alive"][-1][:2] == ["main", "playing"]
    assert set(told) == {f"/mine/{a}" for a in (
        "strike", "level", "x", "y", "gate", "release", "param/k_coll", "param/k_coll/norm", "alive",
    )}  # fmt: skip
    lasted_s, worst_us = summary["duration_s"], summary["lateness_worst_us"]
    assert isinstance(lasted_s, float)
    assert isinstance(worst_us, float)
    assert 0.5 * AT_S[-1] < lasted_s, "twice as fast, and no faster"
    assert lasted_s - 1e-6 * worst_us < 0.8 * AT_S[-1], "twice as fast, but for what the machine stood still"


@pytest.mark.long
def test_a_torn_recording_is_played_as_far_as_it_goes_and_that_is_said(
    free_port: Callable[[], int], tmp_path: Path
) -> None:
    torn = a_roll(tmp_path / "torn.mcap", drum(), finished=False)
    os.truncate(torn, torn.stat().st_size - 300)  # into the last chunk, of the strike at 3.04 s
    with replaying(torn, port=free_port()) as replay:
        status, told, said = replay.ended()
    assert status == 0
    assert "torn.mcap was cut off: whole to byte" in said
    assert "it is played as far as it goes" in said
    assert "the file was cut off" in told
    assert ", 7 strikes, " in told


@pytest.mark.long
def test_what_cannot_be_replayed_is_said(free_port: Callable[[], int], tmp_path: Path) -> None:
    silent = made(tmp_path / "silent.mcap", [(0.0, "/state", a_state(0))])
    junk = tmp_path / "junk.mcap"
    junk.write_bytes(b"RIFF" * 100)
    roll = a_roll(tmp_path / "a.mcap", drum())

    def said(path: Path, *options: str, connect: bool = False, port: int | None = None) -> tuple[int, str]:
        at = free_port() if port is None else port
        with replaying(path, *options, port=at, connect=connect) as replay:
            status, _, words = replay.ended()
        assert "Traceback" not in words
        return status, words

    for path, options, words in (
        (silent, (), "silent.mcap: no strikes in it"),
        (junk, (), "junk.mcap: no MCAP file"),
        (tmp_path / "none.mcap", (), "none.mcap: cannot be read: No such file or directory"),
        (roll, ("--speed", "0"), "--speed 0.0: must be 0.01 .. 100 times the recorded one"),
        (roll, ("--prefix", "nothing"), "OSC prefix 'nothing'"),
    ):
        status, found = said(path, *options)
        assert (status, words in found) == (2, True), found
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        status, found = said(roll, port=taken.getsockname()[1])
    assert (status, "choose another with --listen" in found) == (3, True)
    status, found = said(roll, connect=True)
    assert (status, "no Zenoh router answers" in found) == (3, True)


@pytest.mark.long
def test_beside_a_live_rig_of_that_name_it_refuses_and_under_another_it_plays(tmp_path: Path) -> None:
    roll = a_roll(tmp_path / "a.mcap", drum())
    with running("haptic") as live:
        session = live.client()
        with replaying(roll, "--rig", live.name, port=live.zenoh_port, connect=True) as replay:
            status, _, said = replay.ended()
        assert (status, "is played there already" in said) == (3, True)
        strikes = Listener(session, Keys("again").strike, Strike)
        with replaying(roll, "--rig", "again", "--json", port=live.zenoh_port, connect=True) as replay:
            assert replay.summary()["end"] == "done"
        wait_for("its strikes", lambda: len(strikes.got) == 8)
        session.close()
