"""From the servo's stick to the drum's mesh, in virtual time: every impulse arrives, through a network that jitters."""

import numpy as np
import pytest

import sampled_arm
from drumstick.scenes.scene_text import parse
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.contacts import LISTENED, SAMPLE, SLOTS
from haptic_server.gateway.zenoh.contact_pieces import Pieces
from haptic_server.records import EVENT, RELEASE
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from protocol.clock import HapticClock
from protocol.messages import encode
from protocol.rate_limited_log import RateLimitedLog
from realtime import ring
from realtime.atomics import poke
from sound_server.receiving.contacts import ContactScheduler
from stability.catalogue import shows
from streamed_engine import MS, STREAMS, Player, streamed_text

AHEAD_NS = 77_000_000_000  # of the haptic machine's clock


class Line:
    """A servo, the gateway's pieces, a network that delays messages by up to `jitter_ns`, a scheduler, an engine."""

    def __init__(self, servo: memory.Servo, jitter_ns: int) -> None:
        self.servo, self.jitter_ns = servo, jitter_ns
        assert servo.stream is not None
        self.ring = servo.stream.contacts
        poke(self.ring.cells, LISTENED, 1)
        self.player = Player()
        self.scheduler = ContactScheduler(RateLimitedLog(lambda: 0), lambda _boot: None)
        self.scheduler.clock = HapticClock(9, AHEAD_NS, 0)
        assert self.player.engine.stream is not None
        self.scheduler.play_on(self.player.engine.stream, 0.0)
        self.pieces = Pieces(1000.0)
        self.random = np.random.default_rng(2)
        self.on_the_way: list[tuple[int, bytes]] = []
        self.impulses: list[float] = []
        self.arrived: list[tuple[int, np.ndarray]] = []

    def run(self, ms: int) -> np.ndarray:
        """The mean force over each step of the mesh meanwhile."""
        found: list[np.ndarray] = []
        samples, events = np.zeros(SLOTS, SAMPLE), np.zeros(1024, EVENT)
        for _ in range(ms):
            now = self.player.now_ns
            loop.run_virtual(self.servo, 1, now + AHEAD_NS - MS)
            count = ring.drain(self.ring.cells, self.ring.slots, samples)
            for piece in self.pieces.of(9, samples[:count], now + AHEAD_NS):
                delay = int(self.random.integers(200_000, 200_000 + self.jitter_ns))
                self.on_the_way.append((now + delay, encode(piece)))
                self.arrived.append((now + delay, np.frombuffer(piece.forces, "<f4")))
            count = ring.drain(self.servo.block.ring_cells, self.servo.block.events, events)
            taken = events[:count]
            self.impulses += taken["impulse_N_s"][taken["kind"] == RELEASE].tolist()
            for half in range(2):
                at = now + half * MS // 2
                for arrival, payload in [m for m in self.on_the_way if m[0] <= at]:
                    self.scheduler.take(payload, arrival)
                    self.on_the_way.remove((arrival, payload))
                found.append(self.player.play(MS // 2))
        return np.concatenate(found)


def roll() -> memory.Servo:
    played = parse(streamed_text(), "roll")
    return memory.prepare(played, blocks.in_memory(law_of(played)))


def arm() -> memory.Servo:
    return sampled_arm.servo_of(
        parse(
            sampled_arm.SCENE.format(gesture="strokes", device="", guard="") + f"[drum]\n{STREAMS}\n", "arm"
        )
    )


def _held_on_arrival(arrived: list[tuple[int, np.ndarray]]) -> float:
    # The naive player: a piece's samples from its arrival on, a tick each, until the next one comes.
    total, following = 0.0, sorted(at for at, _ in arrived)
    for at, forces in arrived:
        later = [other for other in following if other > at]
        room = (later[0] - at) / MS if later else float("inf")
        for tick, force in enumerate(forces):
            total += float(force) * 1e-3 * min(max(room - tick, 0.0), 1.0)
    return total


@shows("streamed force that jitters")
@pytest.mark.parametrize("servo_of", [roll, arm])
def test_every_impulse_arrives(servo_of) -> None:
    line = Line(servo_of(), jitter_ns=1 * MS)
    sound = line.run(3000)
    while line.servo.stream.state["inside"][0]:
        sound = np.concatenate([sound, line.run(1)])
    sound = np.concatenate([sound, line.player.play(100 * MS)])
    # What is still on its way belongs to contacts that have ended: let it come.
    for arrival, payload in line.on_the_way:
        line.scheduler.take(payload, arrival)
    sound = np.concatenate([sound, line.player.play(100 * MS)])
    assert len(line.impulses) >= 3
    assert sound.sum() * line.player.step_s == pytest.approx(sum(line.impulses), rel=1e-6)
    assert line.player.state["underflows"] == 0
    assert line.player.state["late"] == line.scheduler.late == 0
    assert line.scheduler.played == len(line.impulses)
    assert abs(_held_on_arrival(line.arrived) / sum(line.impulses) - 1.0) > 0.02


def test_the_rhythm_is_that_of_the_contacts_whatever_the_network_does() -> None:
    """Onsets of a settled roll, heard where the force first passes half its peak: even to a fifth of a tick."""
    line = Line(roll(), jitter_ns=1 * MS)
    line.run(2000)
    sound = line.run(1500)
    high = sound > 0.5 * sound.max()
    starts = np.flatnonzero(high[1:] & ~high[:-1])
    frames = starts + (0.5 * sound.max() - sound[starts]) / (sound[starts + 1] - sound[starts])
    intervals_ms = np.diff(frames) * line.player.step_s * 1e3
    assert len(intervals_ms) > 25
    assert np.ptp(intervals_ms) < 0.2


@shows("streamed force that jitters", "ours")
def test_a_network_worse_than_the_delay_is_heard_counted_and_survived() -> None:
    line = Line(roll(), jitter_ns=12 * MS)
    sound = line.run(2000)
    line.jitter_ns = MS
    line.run(200)
    before = line.player.state["underflows"], line.player.state["late"]
    assert before[0] > 0
    assert before[1] > 0
    assert np.isfinite(sound).all()
    good = line.run(1000)
    assert (line.player.state["underflows"], line.player.state["late"]) == before
    assert sound.max() < 1.5 * good.max()
