"""The sound server of a scene that streams, before a haptic side that the test plays: forces, gaps, another scene."""

import dataclasses
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import zenoh
from haptic_side import HapticSide, drum, sounding
from rig_process import is_subscribed, wait_for

from protocol.messages import Contact, encode

MS = 1_000_000


@pytest.fixture
def side(free_port: Callable[[], int]) -> Iterator[HapticSide]:
    scene = drum(latency_s=0.5)  # a busy machine is late for shorter ones
    streamed = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, excitation="streamed"))
    opened = HapticSide(free_port(), streamed)
    yield opened
    opened.close()


def piece(side: HapticSide, seq: int, forces: list[float], ago_ns: int = 0, boot: int | None = None) -> bytes:
    """A contact that began now, or so long ago, by its own clock at 1 kHz."""
    t_ns = side.now_ns() - ago_ns
    return encode(
        Contact(
            boot=side.boot if boot is None else boot,
            seq=seq,
            first_tick=t_ns // MS,
            rate_Hz=1000.0,
            forces=np.array(forces, "<f4").tobytes(),
            t_ns=t_ns,
            x=0.3,
            y=0.1,
        )
    )


def publisher(side: HapticSide) -> zenoh.Publisher:
    return side.session.declare_publisher(side.keys.contact)


def is_played(side: HapticSide, to: zenoh.Publisher, *forces: float) -> bool:
    """Send a contact twice, and one that is none. False for one that a stall of the machine made late."""
    before = side.meter("the counts", lambda _: True)
    side.strike()  # tells where; starts no pulse
    message = piece(side, side.seq, list(forces))
    to.put(message)
    to.put(message)
    to.put(piece(side, side.seq, [float("nan")]))
    side.meter("the last of them", lambda m: m.refused > before.refused)
    return side.meter("the counts after them", lambda _: True).played > before.played


def test_contacts_sound_once_and_a_scene_without_a_stream_ends_the_subscription(
    side: HapticSide, tmp_path: Path
) -> None:
    with sounding(side.endpoint, "null", tmp_path) as sound:
        side.meter("a sink", lambda m: m.sink == "null")
        to = publisher(side)
        wait_for("a subscriber", lambda: is_subscribed(to))
        for _ in range(5):
            wait_for("a contact in time", lambda: is_played(side, to, 2.0, 4.0, 1.0, 0.0))
        meter = side.meter("five contacts", lambda _: True)
        assert (meter.played, meter.underflows) == (5, 0)
        assert meter.duplicates + meter.late == 2 * meter.refused - 5  # of all that were sent twice
        side.meter("a sound", lambda m: m.peak_left > 0.0)
        wait_for("one whose end never comes", lambda: is_played(side, to, 3.0, 3.0))
        before = side.meter("the gap", lambda m: m.underflows == 1)
        to.put(piece(side, side.seq + 1, [3.0, 0.0], ago_ns=700 * MS))
        side.meter("one too late", lambda m: m.late == before.late + 1)
        # A servo that restarted: it counts from the beginning.
        side.boot, side.seq = 8, 0
        wait_for("its contact", lambda: is_played(side, to, 2.0, 0.0))
        assert side.meter("seven", lambda _: True).played == 7
        side.boot, side.scene = 9, drum(f01_Hz=300.0)
        side.tell_state()
        sound.said("mesh of 33.3 junctions across")
        wait_for("nobody to subscribe any more", lambda: not is_subscribed(to))
        side.struck("a strike by its pulse", lambda m: m.played > 7 and m.peak_left > 0.0)
        assert sound.stop(signal.SIGTERM) == 0


@pytest.mark.long
def test_it_ends_while_contacts_come(side: HapticSide, tmp_path: Path) -> None:
    with sounding(side.endpoint, "null", tmp_path) as sound:
        to = publisher(side)
        wait_for("a subscriber", lambda: is_subscribed(to))
        for tick in range(2000):
            to.put(piece(side, 1 + tick // 50, [1.0]))
        sound.process.send_signal(signal.SIGTERM)
        for tick in range(2000):
            to.put(piece(side, 100 + tick // 50, [1.0]))
        assert sound.ended() == 0
    assert not [line for line in sound.lines if "Traceback" in line]
