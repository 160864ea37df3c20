"""A real haptic machine with a public listener: every role at work over TLS, and those who may not.

All on loopback addresses; what tells local processes from others is TLS, not the address.
"""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import wave
from pathlib import Path

import numpy as np
import pytest
import zenoh
from public_stage import Stage
from rig_process import (
    DRUMSTICK,
    LOOPBACK,
    PATIENCE_S,
    Listener,
    ask,
    bound,
    free_port,
    reply_to,
    wait_for,
)

from drumstick.scenes.scene_text import from_tables
from made_keys import Keyring
from protocol.messages import STICK, Meter, Readback, Release, State, Strike, decode
from protocol.session import client_config
from web_panel.rig.rig_link import RigLink
from web_panel.rig.rig_state import RigState
from web_panel.rig.set_request import SetRequest
from web_panel.rig.view_subscriptions import DOCTOR, RELEASES, STRIKES

pytestmark = pytest.mark.system

FROZEN = """
import sys, time, zenoh
from pathlib import Path
from protocol.access.identity import Identity
from protocol.session import client_config
endpoint, authority, certificate, private_key, *keys = sys.argv[1:]
session = zenoh.open(client_config(endpoint, Identity(Path(authority), Path(certificate), Path(private_key))))
subscribers = [session.declare_subscriber(key, lambda sample: None) for key in keys]
print("ready", flush=True)
while True:
    time.sleep(1.0)
"""


def status(stage: Stage, local: zenoh.Session) -> str:
    states = Listener(local, stage.keys.state, State)
    return wait_for("a state", lambda: states.got[-1].status if states.got else None)


def test_a_listener_follows_the_play_and_can_change_nothing(stage: Stage, local: zenoh.Session) -> None:
    with stage.client("listener") as session:
        strikes = Listener(session, stage.keys.strike, Strike)
        releases = Listener(session, stage.keys.release, Release)
        readbacks = Listener(session, stage.keys.param("*"), Readback)
        wait_for("strikes and releases", lambda: len(strikes.got) > 10 and len(releases.got) > 10)
        assert len({strike.seq for strike in strikes.got}) == len(strikes.got)
        from_tables(json.loads(ask(session, stage.keys.scene)))
        assert decode(ask(session, stage.keys.param("dv_pls")), Readback).value > 0.0
        assert list(session.get(stage.keys.panic, timeout=PATIENCE_S)) == []
        assert list(session.get(stage.keys.set_one("dv_pls"), payload=b"0.3", timeout=PATIENCE_S)) == []
        assert list(session.get(stage.keys.doctor, timeout=PATIENCE_S)) == []
        assert list(session.get(stage.keys.play_strike, payload=b"[0, 0, 1]", timeout=PATIENCE_S)) == []
        wait_for("the four in the count", lambda: stage.door(local)["beyond_role"] == {"listener": 4})
        session.put(stage.keys.strike, b"forged")
        before = len(strikes.got)
        wait_for(
            "more strikes", lambda: len(strikes.got) > before + 10
        )  # it was not stopped, and not deceived
        assert {strike.source for strike in strikes.got} == {STICK}
        wait_for("the forgery in the count", lambda: stage.door(local)["beyond_role"] == {"listener": 5})
        assert readbacks.got == []


def test_a_technicians_commands_reach_the_stick(stage: Stage, local: zenoh.Session) -> None:
    values = json.loads(stage.command("params", "get", "--json", role="technician"))
    assert values["dv_pls"] > 0.0
    stage.command("params", "set", "dv_pls=0.25", role="technician")
    assert decode(ask(local, stage.keys.param("dv_pls")), Readback).value == 0.25
    assert "dv_pls = 0.25" in stage.command("params", "get", role="listener")
    refused = stage.command("params", "set", "dv_pls=0.3", role="listener", status=2)
    assert "is of 'listener'; this command needs the certificate of technician or panel" in refused


def test_the_panels_own_link_sets_and_sees_over_tls(stage: Stage, local: zenoh.Session) -> None:
    rig_state = RigState()
    link = RigLink(stage.rig.name, stage.endpoint, rig_state, stage.identity("panel"))
    link.start()
    try:

        def is_complete() -> bool:
            link.poll(time.monotonic())
            link.watch(frozenset({STRIKES, RELEASES, DOCTOR}))
            always = rig_state.scene is not None and rig_state.state is not None
            watched = rig_state.strike is not None and rig_state.new_releases and rig_state.doctor is not None
            return bool(always and watched and set(rig_state.readbacks) == set(rig_state.table))

        wait_for("scene, state, every value, and what is only heard while watched", is_complete)
        strikes, refusals = Listener(local, stage.keys.strike, Strike), list[str]()
        link.play(0.0, 0.2, 0.5, refusals.append)
        wait_for("its strike", lambda: [each for each in strikes.got if each.source == "zenoh page"])
        assert refusals == []
        answer = link.set(SetRequest({"dv_pls": 0.22}))
        assert answer.taken, answer
        assert decode(ask(local, stage.keys.param("dv_pls")), Readback).value == 0.22
        refused = link.set(SetRequest({"dv_pls": 99.0}))
        assert not refused.taken
        assert refused.reason
    finally:
        link.close()


@pytest.mark.long
def test_the_real_panel_comes_in_and_is_seen(stage: Stage, local: zenoh.Session) -> None:
    port = free_port()
    panel = subprocess.Popen(
        [*DRUMSTICK, "panel", "--rig-file", str(stage.file("panel")), "--rig", stage.rig.name,
         "--panel-port", str(port)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:

        def tokens() -> list[str]:
            replies = local.liveliness().get(stage.keys.alive("panel", "*"), timeout=2.0)
            return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]

        wait_for("the panel's token", tokens)
        wait_for("it among those present", lambda: stage.door(local)["present"].get("panel"))
    finally:
        panel.terminate()
        panel.wait(PATIENCE_S)


@pytest.mark.long
def test_a_sound_server_on_another_machine_plays_into_a_file(
    stage: Stage, local: zenoh.Session, tmp_path: Path
) -> None:
    meters = Listener(local, stage.keys.meter, Meter)
    wav = tmp_path / "far.wav"
    said = stage.command("sound", "--audio", f"wav:{wav}", "--duration", "4", "--json", role="sound")
    summary = json.loads(next(line for line in said.splitlines() if line.startswith("{")))
    assert summary["strikes_played"] > 0  # what comes too late is dropped: how many is the machine's affair
    assert summary["restarts"] == {"sound": 0}
    assert meters.got  # its meters reached the haptic machine
    assert max(meter.played for meter in meters.got) > 0
    with wave.open(str(wav)) as file:
        sound = np.frombuffer(file.readframes(file.getnframes()), np.int16)
    assert np.abs(sound).max() > 1000


def test_an_osc_panic_that_a_stranger_sends_again_is_refused(stage: Stage, local: zenoh.Session) -> None:
    before = stage.doctor(local)["osc"]
    panic = b"/drumstick/panic\0\0\0\0,\0\0\0"  # as it could have been recorded from the network
    assert len(panic) % 4 == 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.2", 0))
        for _ in range(5):
            stranger.sendto(panic, ("127.0.0.1", stage.rig.osc_in))

    def is_counted() -> bool:
        return stage.doctor(local)["osc"].get("source", 0) >= before.get("source", 0) + 5

    wait_for("the refusals", is_counted)
    wait_for("play", lambda: status(stage, local) == "playing")


class Relay:
    """Carries one TCP connection to the public listener and keeps what the client sent."""

    def __init__(self, port: int) -> None:
        self._to = port
        self._door = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._door.getsockname()[1])
        self.sent = bytearray()
        self._ends: list[socket.socket] = []
        self._threads = [threading.Thread(target=self._carry, daemon=True)]
        self._threads[0].start()

    def _carry(self) -> None:
        near, _ = self._door.accept()
        far = socket.create_connection(("127.0.0.1", self._to))
        self._ends = [near, far]
        back = threading.Thread(target=self._pass, args=(far, near, None), daemon=True)
        back.start()
        self._threads.append(back)
        self._pass(near, far, self.sent)

    @staticmethod
    def _pass(source: socket.socket, sink: socket.socket, kept: bytearray | None) -> None:
        with contextlib.suppress(OSError):  # either end may go first
            while data := source.recv(65536):
                if kept is not None:
                    kept += data
                sink.sendall(data)
        with contextlib.suppress(OSError):
            sink.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        for thread in self._threads:
            thread.join(10.0)
        for end in (self._door, *self._ends):
            end.close()


def test_a_recorded_panic_over_tls_cannot_be_played_again(stage: Stage, local: zenoh.Session) -> None:
    relay = Relay(stage.port)
    with zenoh.open(client_config(f"tls/127.0.0.1:{relay.port}", stage.identity("technician"))) as session:
        assert reply_to(session, stage.keys.panic).ok is not None
    relay.close()
    wait_for("the panic", lambda: status(stage, local) == "panic")
    subprocess.run([*DRUMSTICK, "arm", "--rig", stage.rig.name], check=True, timeout=PATIENCE_S)
    wait_for("play after arming", lambda: status(stage, local) == "playing")
    recorded = bytes(relay.sent)
    assert len(recorded) > 1000  # a handshake with a certificate, and what followed
    before = stage.door(local)["handshakes_refused"]
    with socket.create_connection(("127.0.0.1", stage.port)) as thief:
        with contextlib.suppress(OSError):  # refused while it is still sending
            thief.sendall(recorded)
        thief.settimeout(5.0)
        with contextlib.suppress(OSError):
            while thief.recv(65536):
                pass
    wait_for("the refusal", lambda: stage.door(local)["handshakes_refused"] > before)
    wait_for("play", lambda: status(stage, local) == "playing")


def heard_of_made(stage: Stage, local: zenoh.Session, count: int) -> float:
    """The share of the next `count` strikes that a local listener heard."""
    strikes, states = Listener(local, stage.keys.strike, Strike), Listener(local, stage.keys.state, State)
    first = wait_for("a state", lambda: states.got[0] if states.got else None)
    until = first.strikes + count
    wait_for("so many strikes", lambda: states.got[-1].strikes >= until)
    wait_for("the newest of them", lambda: strikes.got and strikes.got[-1].seq >= until)
    return len({strike.seq for strike in strikes.got if first.strikes < strike.seq <= until}) / count


def test_frozen_and_flooding_clients_take_no_strike_from_local_ones(
    stage: Stage, local: zenoh.Session
) -> None:
    identity = stage.identity("sound")
    keys = [stage.keys.strike, stage.keys.release, stage.keys.state]
    frozen = [
        subprocess.Popen(
            [sys.executable, "-c", FROZEN, stage.endpoint, *map(str, identity), *keys],
            stdout=subprocess.PIPE, text=True,
        )
        for _ in range(2)
    ]  # fmt: skip
    flooding = threading.Event()

    def flood() -> None:
        with stage.client("sound") as session:
            while not flooding.wait(0.01):
                for _ in range(10):
                    session.put(stage.keys.strike, bytes(200))  # forged: refused one by one
                    session.put(stage.keys.meter, bytes(200))  # permitted, and nonsense

    flooder = threading.Thread(target=flood)
    try:
        for client in frozen:
            assert client.stdout is not None
            assert client.stdout.readline() == "ready\n"
            client.send_signal(signal.SIGSTOP)
        flooder.start()
        assert heard_of_made(stage, local, 80) >= 0.98
    finally:
        flooding.set()
        if flooder.is_alive():
            flooder.join(20.0)
        for client in frozen:
            client.kill()
            client.wait()
            assert client.stdout is not None
            client.stdout.close()
    assert heard_of_made(stage, local, 50) >= 0.98


def test_a_door_that_is_killed_comes_back_and_no_strike_is_missed_at_home(
    stage: Stage, local: zenoh.Session
) -> None:
    at_home = Listener(local, stage.keys.strike, Strike)
    with stage.client("listener") as session:
        far = Listener(session, stage.keys.strike, Strike)
        wait_for("strikes here and there", lambda: len(at_home.got) > 5 and len(far.got) > 5)
        os.kill(stage.rig.children()["haptic_server.access"], signal.SIGKILL)
        seen = len(far.got)
        wait_for("strikes through the new door", lambda: len(far.got) > seen + 5)
    seqs = [strike.seq for strike in at_home.got]
    assert seqs == list(range(seqs[0], seqs[0] + len(seqs)))
    forced = [strike.seq for strike in far.got]
    assert len(set(forced)) == len(forced)


def test_only_the_public_listener_is_added_to_the_sockets(stage: Stage, local: zenoh.Session) -> None:
    assert status(stage, local)
    children = stage.rig.children()
    assert bound(children["haptic_server.servo"]) == []
    at_home = bound(children["haptic_server.gateway"])
    ports = {address.partition(":")[2] for address in at_home}
    assert ports >= {f"{stage.rig.zenoh_port:04X}", f"{stage.rig.osc_in:04X}"}
    assert all(address.partition(":")[0].endswith(LOOPBACK) for address in at_home)
    # The door: its listener, its clients' links, and one end of the link to the gateway.
    ports = [address.partition(":")[2] for address in bound(children["haptic_server.access"])]
    assert len([port for port in ports if port != f"{stage.port:04X}"]) == 1


@pytest.mark.long
def test_a_second_rig_at_the_same_public_listener_says_so(stage: Stage, local: zenoh.Session) -> None:
    wait_for("the first one's listener", lambda: stage.door(local)["is_open"])
    other = [*DRUMSTICK, "haptic", "--rig-file", str(stage.file("haptic")), "--rig", f"{stage.rig.name}-2"]
    ports = ["--listen", f"tcp/127.0.0.1:{free_port()}", "--osc-in", str(free_port())]
    done = subprocess.run([*other, *ports], capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 3, done.stderr
    assert f"public Zenoh port 127.0.0.1:{stage.port}: Address already in use" in done.stderr
    assert "choose another with zenoh.public of the rig file" in done.stderr


@pytest.mark.long
def test_a_service_that_is_refused_says_why_and_ends(
    stage: Stage, local: zenoh.Session, tmp_path: Path
) -> None:
    assert stage.door(local)["is_open"]
    theirs = Keyring(tmp_path / "foreign").identity("sound")
    file = tmp_path / "rig.toml"
    file.write_text(
        f'[zenoh]\nconnect = "{stage.endpoint}"\n[keys]\nauthority = "{theirs.authority}"\n'
        f'certificate = "{theirs.certificate}"\nprivate_key = "{theirs.private_key}"\n'
    )
    command = [*DRUMSTICK, "sound", "--audio", "null", "--rig", stage.rig.name, "--rig-file", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 3, done.stderr
    assert f"{stage.endpoint} cannot be joined: its certificate is not of our authority" in done.stderr
