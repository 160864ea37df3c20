"""Notes from a process that listens: each is played once, a refusal is logged and no more, and it ends when asked."""

import logging
import sys
import time
from collections.abc import Callable

import pytest

from drumstick.scenes.table import Refusal
from haptic_server.gateway.midi import receiver as receivers
from haptic_server.gateway.midi.note_map import NoteMap
from haptic_server.gateway.midi.port_process import PortProcess
from haptic_server.gateway.midi.receiver import MidiReceiver
from osc_bench import BOUND_S

SAYS = (
    "import sys, json\n"
    "print(json.dumps({'open': True, 'words': 'strikes come from X'}), flush=True)\n"
    "for message in ((0x99, 36, 127), (0x89, 36, 64), (0x99, 40, 64)):\n"
    "    print(json.dumps({'heard': message}), flush=True)\n"
    "sys.stdin.read()\n"
)


def nobody(*_: object) -> None:
    raise AssertionError("no controller came")


class Player:
    """Notes what is played; `refusal`: raised instead."""

    def __init__(self, refusal: str = "") -> None:
        self.played: list[tuple[object, ...]] = []
        self.refusal = refusal

    def play(self, *given: object) -> None:
        if self.refusal:
            raise Refusal(self.refusal)
        self.played.append(given)

    def choke(self, source: str) -> None:
        self.play("choke", source)


def test_what_the_process_hears_is_played(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(receivers, "_JOIN_S", BOUND_S)
    player = Player()
    receiver = MidiReceiver(NoteMap(), player, nobody, nobody)
    with caplog.at_level(logging.WARNING):
        receiver.listen(PortProcess([sys.executable, "-c", SAYS], receiver.take))
        end = time.monotonic() + BOUND_S
        while len(player.played) < 2:
            assert time.monotonic() < end
            time.sleep(0.01)
        assert receiver.counters == {"open": 1}
        receiver.close()
    assert player.played == [(0.0, 0.0, 1.0, "midi"), (0.6, 0.0, 64 / 127, "midi")]
    assert [record.message for record in caplog.records] == ["midi: strikes come from X"]
    assert receiver.counters == {"open": 0}


def test_a_refusal_is_told_now_and_then(caplog: pytest.LogCaptureFixture) -> None:
    receiver = MidiReceiver(NoteMap(), Player("too many"), nobody, nobody)
    with caplog.at_level(logging.WARNING):
        for _ in range(1000):
            receiver.take(b"\x99\x26\x40")
    assert [record.message for record in caplog.records] == ["midi: a note was not played: too many"]
    receiver.close()


def test_controllers_ask_for_the_roll_and_for_the_drums_values(caplog: pytest.LogCaptureFixture) -> None:
    asked: list[tuple[str, float]] = []

    def ask(name: str, value: float, refused: Callable[[str], None]) -> None:
        asked.append((name, value))
        refused("nearest 55 Hz")

    receiver = MidiReceiver(NoteMap(channel=10), Player(), ask, nobody)
    with caplog.at_level(logging.WARNING):
        for message in (
            b"\xb9\x12\x00",
            b"\xb9\x12\x7f",
            b"\xb9\x13\x7f",
            b"\xb9\x13\x00",
            b"\xb9\x07\x7f",
            b"\xb9\x07\x00",
            b"\xb9\x0a\x40",
            b"\xb9\x0a\x00",
            b"\xb9\x0a\x7f",
            b"\xb9\x14\x7f",
            b"\xb9\x15\x00",
            b"\xb9\x16\x00",
            b"\xb9\x16\x7f",
            b"\xb9\x4b\x00",
            b"\xb9\x4b\x7f",
            b"\xb9\x17\x00",
            b"\xb9\x17\x7f",
            b"\xb9\x4a\x00",
            b"\xb9\x4a\x7f",
            b"\xb9\x18\x40",
            b"\xb9\x19\x00",
            b"\xb9\x1a\x7f",
            b"\xb9\x1b\x40",
            b"\xb9\x1c\x32",
            b"\xb9\x1d\x00",
            b"\xb9\x1d\x7f",
            b"\xb9\x06\x40",
            b"\xb0\x12\x40",
        ):
            receiver.take(message)
    assert asked == [
        ("rate", 4.0),
        ("rate", 64.0),
        ("level", 1.0),
        ("level", 1 / 127),
        ("listen.gain", 0.0),
        ("listen.gain", -60.0),
        ("listen.pan", 0.0),
        ("listen.pan", -1.0),
        ("listen.pan", 1.0),
        ("muffle", 1.0),
        ("strainer", 0.0),
        ("drum.f01", 40.0),
        ("drum.f01", 640.0),
        ("drum.t60", 0.1),
        ("drum.t60", 12.8),
        ("mallet.mass", 0.001),
        ("mallet.mass", pytest.approx(0.128)),
        ("mallet.stiffness", 1e5),
        ("mallet.stiffness", pytest.approx(1e10)),
        ("pickup-1.x", 0.0),
        ("pickup-1.y", -1.0),
        ("pickup-2.x", 1.0),
        ("pickup-2.y", 0.0),
        ("tension.glide", 200.0),
        ("tension.young", 0.1),
        ("tension.young", pytest.approx(12.8)),
    ]
    assert caplog.records[0].message == "midi: a controller changed nothing: nearest 55 Hz"
    receiver.close()


def test_programs_ask_for_scenes(caplog: pytest.LogCaptureFixture) -> None:
    asked: list[int] = []

    def ask(program: int) -> None:
        asked.append(program)
        if program == 127:
            raise Refusal("no number 128")

    receiver = MidiReceiver(NoteMap(channel=10), Player(), nobody, ask)
    with caplog.at_level(logging.WARNING):
        for message in (b"\xc9\x00", b"\xc9\x7f", b"\xc0\x03", b"\xd9\x03"):
            receiver.take(message)
    assert asked == [0, 127]
    assert [record.message for record in caplog.records] == ["midi: a program changed nothing: no number 128"]
    receiver.close()


def test_a_hand_on_a_pad_chokes_in_order_with_the_notes() -> None:
    player = Player()
    receiver = MidiReceiver(NoteMap(channel=10), player, nobody, nobody)
    for message in (
        b"\x99\x31\x7f",
        b"\xa9\x31\x7f",  # a hand takes hold
        b"\xa9\x31\x50",  # and holds
        b"\xa9\x31\x00",
        b"\x99\x31\x7f",
        b"\xd9\x40",  # of the whole channel
        b"\xb9\x78\x00",  # all sound off
        b"\xa0\x31\x7f",  # another channel
    ):
        receiver.take(message)
    strike, choke = (0.5, 0.0, 1.0, "midi"), ("choke", "midi")
    assert player.played == [strike, choke, strike, choke, choke]
    receiver.close()
