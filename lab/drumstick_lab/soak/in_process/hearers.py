"""Subscribers of the virtual form: the sound server's scheduler, a recorder, a clock map. Their own code, no wire."""

import json
import random
from pathlib import Path

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables
from drumstick_lab.soak.listeners import Sequence
from protocol.clock import ClockMap, HapticClock, RoundTrip
from protocol.messages import Release, State, Strike, decode, encode
from realtime import ring
from rig.recording import channels
from rig.recording.channels import Channel
from rig.recording.lost_messages import LostMessages
from rig.recording.mcap_writer import SCENE_ATTACHMENT, McapWriter
from rig.recording.times import TimeLine

SECOND_NS = 10**9
# The clocks that are mapped: this much apart at the start, the haptic one running this much faster.
_APART_NS, _DRIFT = 7_777 * SECOND_NS, 40e-6
_TWICE_EVERY = 50  # strikes: the network brings one again
_REMEMBERED = 5000  # strikes, more than the scheduler remembers
_WALL_NS = 1_800_000_000 * SECOND_NS
_SHORTEST_TRIP_NS, _MEAN_WAIT_NS = 80_000, 400_000


class Clocks:
    """Two machines' clocks, compared as a listener does. `now_ns` is the haptic machine's."""

    def __init__(self, boot: int, start_ns: int) -> None:
        self._boot, self._start_ns = boot, start_ns
        self._random = random.Random(2007)
        self._map = ClockMap()
        self.clock: HapticClock | None = None
        self.worst_error_ns = 0.0
        self.error_ns = 0.0
        self.beyond = 0  # times that the map was further off than it says it can be

    def ours(self, now_ns: int) -> int:
        """The listener's clock at that instant, truly."""
        return now_ns - _APART_NS - round(_DRIFT * (now_ns - self._start_ns))

    def compare(self, now_ns: int) -> HapticClock | None:
        """Five round trips that end about now, each way as slow as a network is; what the map says then."""
        trips: list[RoundTrip] = []
        for i in range(5):
            there, back = (
                _SHORTEST_TRIP_NS + round(self._random.expovariate(1 / _MEAN_WAIT_NS)) for _ in range(2)
            )
            answer_ns = now_ns + i * 10_000_000
            trips.append(
                RoundTrip(self.ours(answer_ns - there), self.ours(answer_ns + back), self._boot, answer_ns)
            )
        self._map.add(trips)
        self.clock = self._map.clock()
        if self.clock is not None:
            self.error_ns = float(abs(self.clock.ours(now_ns) - self.ours(now_ns)))
            self.worst_error_ns = max(self.worst_error_ns, self.error_ns)
            self.beyond += self.error_ns > self.clock.error_ns
        return self.clock


class VirtualSound:
    """The sound server's scheduler, and the audio thread that empties its ring."""

    def __init__(self, clocks: Clocks) -> None:
        import numpy as np

        from drumstick.drum.memory.strikes import EVENT, RING_SLOTS, StrikeRing
        from protocol.rate_limited_log import RateLimitedLog
        from sound_server.receiving.strikes import StrikeScheduler

        self._clocks = clocks
        self._now_ns = 0
        self.scheduler = StrikeScheduler(
            StrikeRing(), RateLimitedLog(lambda: self._now_ns), lambda boot: None
        )
        self._out = np.zeros(RING_SLOTS, EVENT)
        self._count = 0
        self.brought_again = 0
        self.sounded = 0

    def fill(self) -> None:
        """Let it remember as many strikes of an earlier boot as it ever will; they are not counted."""
        for seq in range(_REMEMBERED):
            strike = Strike(
                boot=1, seq=seq, t_ns=0, x=0.0, y=0.0, z_speed_m_per_s=1.0, level=0.5, peak_estimate_N=1.0,
                contact_estimate_s=0.005,
            )  # fmt: skip
            self.scheduler.take(encode(strike), 0)
            self.step(0)
        self.scheduler.played = self.sounded = 0

    def take(self, payload: bytes) -> None:
        """A strike message; each fiftieth comes twice."""
        self._count += 1
        self.scheduler.clock = self._clocks.clock
        for _ in range(1 + (self._count % _TWICE_EVERY == 0)):
            self.scheduler.take(payload, self._now_ns)
        self.brought_again += self._count % _TWICE_EVERY == 0

    def step(self, now_ns: int) -> None:
        """The audio thread takes what waits; `now_ns` of the haptic clock."""
        self._now_ns = self._clocks.ours(now_ns)
        self.sounded += int(ring.drain(self.scheduler.ring.cells, self.scheduler.ring.slots, self._out))


class Recording:
    """A recorder's file, written as the recorder writes it. `step` and takes raise OSError when the disk is full."""

    def __init__(self, out: Path, scene: Scene, clocks: Clocks) -> None:
        self._clocks = clocks
        self._ours_ns = 0
        self._haptic_ns = 0
        self._line = TimeLine(_WALL_NS)
        self._filing = McapWriter(out, {"rig": "soak"})
        self._filing.attach_scene(SCENE_ATTACHMENT, json.dumps(as_tables(scene)).encode(), _WALL_NS)
        self.gaps = LostMessages()
        self.worst_ns = 0.0  # of a strike's place on the time line
        self.strikes = Sequence()

    def strike(self, payload: bytes) -> None:
        """A strike message."""
        strike = decode(payload, Strike)
        self.strikes.note(strike.boot, strike.seq)
        event_ns = self._put(channels.STRIKE, strike)
        if self._line.clock is not None:
            truly = self._line.wall_ns(self._clocks.ours(strike.t_ns))
            self.worst_ns = max(self.worst_ns, float(abs(event_ns - truly)))

    def release(self, payload: bytes) -> None:
        """A release message."""
        self._put(channels.RELEASE, decode(payload, Release))

    def state(self, payload: bytes) -> None:
        """A state message."""
        self._put(channels.STATE, decode(payload, State))

    def _put(self, channel: Channel, message: Strike | Release | State) -> int:
        event_ns = self._line.event_ns(message.t_ns, message.boot, self._ours_ns)
        self._filing.put(channel, "", message, self._line.wall_ns(self._ours_ns), event_ns, self._ours_ns)
        self.gaps.note(channel, message)
        return event_ns

    def learn(self, clock: HapticClock | None) -> None:
        """A clock that was measured."""
        if clock is not None:
            self._line.learn(clock)

    def step(self, now_ns: int) -> None:
        """The time, by the haptic clock; ends a chunk that is a second old."""
        self._ours_ns = self._clocks.ours(now_ns)
        self._filing.chunk_if_due(self._ours_ns)

    def close(self) -> None:
        """Finish the file."""
        self._filing.finish()
