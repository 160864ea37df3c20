"""Strikes as MIDI through a real MIDI system: JACK's dummy server, the library, and a listener of another process."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from jack_server import Jack, jack_server
from rig_process import DRUMSTICK, PATIENCE_S, Listener, Rig, ask, running, wait_for

from haptic_server.gateway.midi.encoding import controller_value, velocity
from protocol.messages import Strike

pytestmark = pytest.mark.needs("jackd")
PORT = "drum machine"


class Heard:
    """The messages that came to a JACK MIDI port."""

    def __init__(self, environment: dict[str, str]) -> None:
        self.messages: list[tuple[int, bytes]] = []
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("midi_listener.py")), PORT],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment,
        )  # fmt: skip
        self.listens = threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        assert self.listens.wait(PATIENCE_S)

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.strip() == "listens":
                self.listens.set()
                continue
            at_ns, _, message = line.partition(" ")
            self.messages.append((int(at_ns), bytes.fromhex(message.strip())))

    def kinds(self, kind: int) -> list[bytes]:
        return [message for _, message in self.messages if message[0] & 0xF0 == kind]

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join(5.0)
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.fixture(scope="module")
def jack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Jack]:
    """One for all tests: it waits 6 s for clients that were killed before it ends."""
    with jack_server(dict(os.environ), tmp_path_factory.mktemp("jack"), waits=True) as started:
        yield started


@contextmanager
def listening(jack: Jack) -> Iterator[Heard]:
    heard = Heard(jack.environment)
    try:
        yield heard
    finally:
        heard.close()


@contextmanager
def playing(jack: Jack, monkeypatch: pytest.MonkeyPatch, *options: str) -> Iterator[Rig]:
    for variable in ("JACK_DEFAULT_SERVER", "JACK_NO_AUDIO_RESERVATION", "JACK_NO_START_SERVER"):
        monkeypatch.setenv(variable, jack.environment[variable])
    with running("haptic", "--scene", "roll", *options) as rig:
        yield rig


def _all_heard(told: list[int], heard: Heard) -> bool:
    # The same, in the same order, none left out.
    return bytes(told) in bytes(note[2] for note in heard.kinds(0x90))


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_notes_follow_strikes(jack: Jack, monkeypatch: pytest.MonkeyPatch) -> None:
    with (
        listening(jack) as heard,
        playing(
            jack, monkeypatch, "--midi-out", "DRUM mach", "--midi-note", "40", "--midi-channel", "3"
        ) as rig,
    ):
        session = rig.client()
        # The port may appear some strikes after the first one: what was struck before is no note.
        wait_for("notes", lambda: heard.kinds(0x90))
        strikes = Listener(session, rig.keys.strike, Strike)
        wait_for("strikes", lambda: strikes.got)

        def dropped() -> int:
            return json.loads(ask(session, rig.keys.doctor))["midi"].get("late", 0)

        told, noted_ns, end = list[int](), 0, ""
        while end != "all":  # a note that waited for over 50 ms is dropped, and counted: then all once more
            before, noted_ns = dropped(), time.monotonic_ns()
            for dv in (0.1, 0.3, 0.15, 0.25):
                ask(session, rig.keys.set_one("dv_pls"), dv)
                count = len(strikes.got)
                wait_for("more strikes", lambda count=count: len(strikes.got) > count + 5)
            # A gateway that has just started also publishes what was struck a little before.
            told = [velocity(strike.level) for strike in strikes.got if strike.t_ns > noted_ns]
            end = wait_for(
                "their notes, or word of a dropped one",
                lambda told=told, before=before: (
                    "all" if _all_heard(told, heard) else "dropped" * (dropped() > before)
                ),
            )
        session.close()
        assert rig.stop() == 0
        # The listener is another process: what the rig sent last may still be under way.
        wait_for("all notes off", lambda: heard.messages[-1][1] == bytes((0xB2, 123, 0)))
        notes = heard.kinds(0x90)
        assert {(note[0], note[1]) for note in notes} == {(0x92, 40)}
        assert len(set(told)) > 4
        assert _all_heard(told, heard)
        assert len(heard.kinds(0x80)) in (len(notes), len(notes) + 1)  # the last one again, at the end
        assert heard.messages[-1][1] == bytes((0xB2, 123, 0))
        controls = {message[1]: message[2] for message in heard.kinds(0xB0)[:2]}
        assert controls.keys() == {16, 17}
        places = {
            (controller_value(strike.x), controller_value(strike.y))
            for strike in strikes.got
            if strike.t_ns > noted_ns
        }
        moved = [message[2] for message in heard.kinds(0xB0) if message[1] == 16]
        assert {x for x, _ in places} <= set(moved)
        assert f"strikes go to listener:{PORT}" in rig.said


@pytest.mark.long
def test_panic_ends_every_note(jack: Jack, monkeypatch: pytest.MonkeyPatch) -> None:
    with listening(jack) as heard, playing(jack, monkeypatch, "--midi-out", PORT) as rig:
        session = rig.client()
        wait_for("notes", lambda: len(heard.kinds(0x90)) > 5)
        ask(session, rig.keys.panic)
        wait_for("all notes off", lambda: (0xB9, 123, 0) in [tuple(m) for _, m in heard.messages])
        counters = json.loads(ask(session, rig.keys.doctor))["midi"]
        assert counters["notes"] >= 5
        assert counters["open"] == 1
        session.close()


@pytest.mark.long
def test_a_killed_gateway_leaves_no_note_and_comes_back(jack: Jack, monkeypatch: pytest.MonkeyPatch) -> None:
    with listening(jack) as heard, playing(jack, monkeypatch, "--midi-out", PORT) as rig:
        wait_for("notes", lambda: len(heard.kinds(0x90)) > 5)
        os.kill(rig.children()["haptic_server.gateway"], signal.SIGKILL)
        wait_for("all notes off", lambda: (0xB9, 123, 0) in [tuple(m) for _, m in heard.messages])
        count = len(heard.kinds(0x90))
        wait_for("notes again", lambda: len(heard.kinds(0x90)) > count + 5)


@pytest.mark.long
def test_a_port_that_goes_is_awaited_and_told_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with (
        jack_server(dict(os.environ), tmp_path, waits=True) as jack,
        playing(jack, monkeypatch, "--midi-out", PORT) as rig,
    ):
        wait_for("word of it", lambda: "waiting for it" in rig.said)
        for _ in range(2):
            with listening(jack) as heard:
                wait_for("notes", lambda heard=heard: len(heard.kinds(0x90)) > 5)
            said = len(rig.lines)
            wait_for("word of it", lambda said=said: any("is away" in line for line in rig.lines[said:]))
        jack.close()
        jack.start()
        wait_for("JACK", jack.is_up)
        with listening(jack) as heard:
            wait_for("notes", lambda: len(heard.kinds(0x90)) > 5)
        assert rig.stop() == 0
    told = [line for line in rig.lines if "midi:" in line]
    assert len([line for line in told if "strikes go to" in line]) == 3
    assert len([line for line in told if "away" in line or "waiting" in line]) <= 4, told


@pytest.mark.long
def test_a_virtual_port_can_be_connected_to(jack: Jack, monkeypatch: pytest.MonkeyPatch) -> None:
    with playing(jack, monkeypatch, "--midi-out", "virtual") as rig:
        wait_for("the port", lambda: f"strikes go to drumstick {rig.name}" in rig.said)
        look = (
            "from haptic_server.gateway.midi.jack import Jack\n"
            "assert Jack().runs('look')\n"
            "import os, rtmidi2\n"
            "print(rtmidi2.MidiIn('look', api=rtmidi2.API_UNIX_JACK).ports, flush=True)\n"
            "os._exit(0)\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", look], capture_output=True, text=True, env=jack.environment, check=True
        )
        assert f"drumstick {rig.name}" in done.stdout


def test_notes_play_the_drum(jack: Jack, monkeypatch: pytest.MonkeyPatch) -> None:
    options = ("--midi-in", "virtual", "--midi-in-notes", "36:0,41:-0.8", "--midi-in-curve", "2")
    with playing(jack, monkeypatch, *options) as rig:
        session = rig.client()
        strikes = Listener(session, rig.keys.strike, Strike)
        wait_for("the port", lambda: f"strikes come from drumstick {rig.name} in" in rig.said)
        player = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("midi_player.py")), f"drumstick {rig.name} in"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=jack.environment,
        )  # fmt: skip
        try:
            assert player.stdin is not None
            assert player.stdout is not None
            assert player.stdout.readline() == "plays\n"
            for note, velocity_, count in ((36, 127, 1), (36, 0, 1), (41, 64, 2), (60, 1, 3)):
                player.stdin.write(f"{note} {velocity_}\n")
                player.stdin.flush()
                wait_for(
                    "the strike",
                    lambda count=count: len([s for s in strikes.got if s.source == "midi"]) == count,
                )
        finally:
            player.kill()
            player.wait()
            for pipe in (player.stdin, player.stdout):
                assert pipe is not None
                pipe.close()
        heard = [strike for strike in strikes.got if strike.source == "midi"]
        assert [(strike.x, strike.level) for strike in heard] == [
            (0.0, 1.0),
            (-0.8, pytest.approx((64 / 127) ** 2)),
            (0.5, pytest.approx((1 / 127) ** 2)),
        ]
        assert json.loads(ask(session, rig.keys.doctor))["midi_in"] == {"open": 1}
        session.close()
        assert rig.stop() == 0


@pytest.mark.long
def test_ports_are_listed(jack: Jack) -> None:
    with listening(jack):
        done = subprocess.run(
            [*DRUMSTICK, "up", "--midi-out", "list", "--json"],
            capture_output=True, text=True, env=jack.environment, check=True, timeout=PATIENCE_S,
        )  # fmt: skip
        assert json.loads(done.stdout) == {"ports": [f"listener:{PORT}"]}
