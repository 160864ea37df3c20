"""Strikes over a bad network, in virtual time: late, lost, doubled and overtaken ones, and clocks that drift apart.

A servo strikes; a network delays each message by what it likes, loses some and delivers some twice; round trips of the
`clock` query go the same way; the sound server schedules. Whatever comes in time sounds at its contact plus the
scene's latency, once; nothing sounds late without being counted.
"""

import heapq
import random
import time
from dataclasses import dataclass, field
from typing import NamedTuple

import pytest

from protocol.clock import ClockMap, RoundTrip
from protocol.messages import Strike, encode
from protocol.rate_limited_log import RateLimitedLog
from sound_server.receiving.strikes import StrikeScheduler
from stability.catalogue import shows

MS = 1_000_000
S = 1_000 * MS
BOOT = 7
TOO_LATE_MS = 50.0  # beyond its instant: dropped


class Weather(NamedTuple):
    """State of the network: least delay and mean jitter (exponential), ms; shares that are lost and doubled."""

    least_ms: float
    jitter_ms: float
    lost: float = 0.0
    doubled: float = 0.0
    most_jitter_ms: float = 1e9


GOOD = Weather(0.1, 0.05)
STAGE_WLAN = Weather(2.0, 8.0, 0.02, 0.01)
BAD = Weather(5.0, 60.0, 0.05, 0.05, most_jitter_ms=200.0)


@dataclass
class Played:
    """Stands for the ring to the audio: what was scheduled for when (0: at once), and when that was said, ns."""

    onsets: list[tuple[int, int]] = field(default_factory=list)
    now_ns: int = 0

    def push(self, onset_ns: int, *_blow: float) -> bool:
        self.onsets.append((onset_ns, self.now_ns))
        return True


class Line:
    """One hour at most of strikes at `rate_Hz` from a haptic machine whose clock gains `drift` on ours."""

    def __init__(self, weather: Weather, latency_s: float, drift: float, seed: int) -> None:
        self._chance = random.Random(seed)
        self._weather = weather
        self._drift = drift
        self.played = Played()
        self.scheduler = StrikeScheduler(self.played, RateLimitedLog(lambda _: None), lambda _: None)  # type: ignore[arg-type]
        self.scheduler.latency_s = latency_s
        self._clock = ClockMap()
        self.sent = self.lost = self.doubled = 0
        self.contacts: list[
            int
        ] = []  # our time of each strike that was delivered, in the order of its first arrival

    def haptic(self, our_ns: int) -> int:
        return 10**15 + our_ns + round(self._drift * our_ns)

    def _delay(self) -> int:
        jitter = min(self._chance.expovariate(1.0 / self._weather.jitter_ms), self._weather.most_jitter_ms)
        return round((self._weather.least_ms + jitter) * MS)

    def measure(self, now_ns: int) -> None:
        """Five round trips, as the sound server asks for them."""
        trips: list[RoundTrip] = []
        for _ in range(5):
            there = now_ns + self._delay()
            back = there + self._delay()
            trips.append(RoundTrip(now_ns, back, BOOT, self.haptic(there)))
            now_ns = back
        self._clock.add(trips)
        self.scheduler.clock = self._clock.clock()

    def run(self, seconds: int, rate_Hz: float = 25.0) -> None:
        arrivals: list[tuple[int, int, bytes, int]] = []
        for seq in range(round(seconds * rate_Hz)):
            contact_ns = S + round(seq * S / rate_Hz)
            self.sent += 1
            if self._chance.random() < self._weather.lost:
                self.lost += 1
                continue
            copies = 2 if self._chance.random() < self._weather.doubled else 1
            self.doubled += copies - 1
            for copy in range(copies):
                arrival = contact_ns + self._delay()
                heapq.heappush(
                    arrivals, (arrival, 2 * seq + copy, _struck(self, seq, contact_ns), contact_ns)
                )
        next_clock_ns, seen = 0, set[int]()
        while arrivals:
            now_ns, name, payload, contact_ns = heapq.heappop(arrivals)
            while now_ns >= next_clock_ns:
                self.measure(next_clock_ns)
                next_clock_ns += round(self._clock.pause_s * S)
            self.played.now_ns = now_ns
            if name // 2 not in seen:
                seen.add(name // 2)
                before = len(self.played.onsets)
                self.scheduler.take(payload, now_ns)
                if len(self.played.onsets) > before:
                    self.contacts.append(contact_ns)
            else:
                self.scheduler.take(payload, now_ns)


@pytest.mark.daily("*-0.0")
@shows("clocks that drift apart", "ours")
@shows("strikes late, lost and doubled", "ours")
@pytest.mark.parametrize("drift", [0.0, 100e-6, -100e-6])
@pytest.mark.parametrize(
    ("weather", "latency_s", "true_ms"),
    [(GOOD, 0.02, 0.3), (STAGE_WLAN, 0.08, 4.0), (BAD, 0.25, 12.0)],
    ids=["good", "wlan", "bad"],
)
def test_every_strike_once_at_its_instant_or_counted(
    weather: Weather, latency_s: float, true_ms: float, drift: float
) -> None:
    line = Line(weather, latency_s, drift, seed=2007)
    line.run(seconds=600)
    scheduler = line.scheduler
    assert scheduler.played + scheduler.late == line.sent - line.lost
    assert scheduler.duplicates == line.doubled
    assert len(line.played.onsets) == scheduler.played
    wrong_ms = [
        (max(onset, now) - (contact + latency_s * S)) / MS
        for (onset, now), contact in zip(line.played.onsets, line.contacts, strict=True)
    ]
    # The instant is true within what the clocks' mapping can be; what came after it is at most 50 ms late.
    assert min(wrong_ms) > -true_ms
    assert max(wrong_ms) < TOO_LATE_MS + true_ms
    punctual = [w for w, (onset, now) in zip(wrong_ms, line.played.onsets, strict=True) if onset > now]
    assert max(map(abs, punctual)) < true_ms
    assert len(punctual) > 0.98 * (line.sent - line.lost)
    told = scheduler.arrivals.summary()
    assert told.arrival_ms == pytest.approx(weather.least_ms + 0.69 * weather.jitter_ms, rel=0.3, abs=true_ms)
    # Some that came after their instant may have been too late altogether.
    assert told.unpunctual >= len(wrong_ms) - len(punctual)


class OnArrival:
    """The naive scheduler: whatever comes, sounds."""

    def __init__(self, played: Played) -> None:
        self.played, self.clock, self.latency_s = played, None, 0.0

    def take(self, _payload: bytes, now_ns: int) -> None:
        self.played.push(now_ns, 0.0, 0.0, 0.0, 0.0)


@shows("strikes late, lost and doubled", "naive")
def test_played_on_arrival_strikes_sound_twice_and_whenever_they_come() -> None:
    line = Line(BAD, 0.25, 0.0, seed=2007)
    line.scheduler = OnArrival(line.played)  # type: ignore[assignment]
    line.run(seconds=600)
    assert len(line.played.onsets) == line.sent - line.lost + line.doubled
    contacts_ns = [S + round(seq * S / 25.0) for seq in range(line.sent)]
    onsets_ns = sorted(onset for onset, _ in line.played.onsets)
    # Even if each sounded for the contact just before it: a tenth of them are later than a flam.
    late_ms = [
        min((o - c) / MS for c in contacts_ns[max(0, (o - S) * 25 // S - 1) : (o - S) * 25 // S + 1])
        for o in onsets_ns
    ]
    assert sum(ms > 25.0 for ms in late_ms) > 0.1 * len(late_ms)


@shows("strikes late, lost and doubled")
def test_a_roll_keeps_its_rhythm_over_a_shaky_network() -> None:
    """Without the scene's latency the jitter of the network is heard; with it, what the clocks are unsure of."""
    at_once, evened = Line(STAGE_WLAN, 0.0, 50e-6, seed=3), Line(STAGE_WLAN, 0.1, 50e-6, seed=3)
    for line in (at_once, evened):
        line.run(seconds=120)

    def unevenness_ms(line: Line) -> float:
        wrong = sorted(
            (max(onset, now) - contact) / MS
            for (onset, now), contact in zip(line.played.onsets, line.contacts, strict=True)
        )
        return wrong[round(0.95 * len(wrong))] - wrong[round(0.05 * len(wrong))]

    assert unevenness_ms(at_once) > 15.0
    assert unevenness_ms(evened) < 4.0


@shows("clocks that drift apart", "naive")
def test_drift_that_is_not_taken_out_would_show() -> None:
    """The naive clock, one measurement for ever: after ten minutes it is 60 ms wrong, and everything is dropped."""
    line = Line(GOOD, 0.02, -100e-6, seed=5)
    line.measure(0)
    frozen = line.scheduler.clock
    line.measure = lambda _now_ns: None  # type: ignore[method-assign]
    line.run(seconds=900)
    assert line.scheduler.clock is frozen
    assert line.scheduler.late > 100


@shows("clock that is set", "ours")
def test_the_wall_clock_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    jumps = random.Random(9)
    monkeypatch.setattr(time, "time", lambda: jumps.uniform(-1e9, 1e10))
    monkeypatch.setattr(time, "time_ns", lambda: jumps.randrange(-(10**18), 10**19))
    line = Line(GOOD, 0.02, 100e-6, seed=2007)
    line.run(seconds=60)
    still = Line(GOOD, 0.02, 100e-6, seed=2007)
    monkeypatch.undo()
    still.run(seconds=60)
    assert line.played.onsets == still.played.onsets


def _struck(line: Line, seq: int, contact_ns: int) -> bytes:
    return encode(
        Strike(
            boot=BOOT, seq=seq, t_ns=line.haptic(contact_ns), x=0.1, y=0.1, z_speed_m_per_s=0.6, level=0.3,
            peak_estimate_N=5.0, contact_estimate_s=0.005,
        )
    )  # fmt: skip


@shows("clock that is set")
@pytest.mark.parametrize("naive", [False, True])
def test_a_wall_clock_that_is_set_takes_no_strike(naive: bool) -> None:
    """The naive one asks the wall what time it is, and somebody sets it two seconds on: all that follows is late."""
    line = Line(GOOD, 0.02, 0.0, seed=4)
    line.measure(0)
    for seq in range(100):
        contact_ns = S + seq * 40 * MS
        now_ns = contact_ns + MS + (2 * S if naive and seq >= 50 else 0)
        line.scheduler.take(_struck(line, seq, contact_ns), now_ns)
    assert (line.scheduler.played, line.scheduler.late) == ((50, 50) if naive else (100, 0))


@shows("pause of the network")
def test_a_pause_of_three_seconds_plays_nothing_late() -> None:
    """The sound host stood still, or its link was cut: what waited in buffers comes all at once, and is dropped."""
    line = Line(GOOD, 0.02, 0.0, seed=1)
    line.measure(0)
    burst = OnArrival(Played())
    for seq in range(75):
        payload = _struck(line, seq, S + seq * 40 * MS)
        line.scheduler.take(payload, 4 * S)
        burst.take(payload, 4 * S)
    in_time = [seq for seq in range(75) if S + seq * 40 * MS + 20 * MS + TOO_LATE_MS * MS >= 4 * S]
    assert line.scheduler.played == len(in_time) < 3
    assert line.scheduler.late == 75 - len(in_time)
    assert [onset for onset, _ in burst.played.onsets] == [4 * S] * 75
