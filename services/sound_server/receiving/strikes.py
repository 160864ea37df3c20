"""Scheduling of strike messages: checked, played once, at their instants, or dropped and counted.

`StrikeScheduler` is fed by the one thread that reads strikes; its counters may be read, and its clock, latency and ring
replaced, from any thread.
"""

from collections import OrderedDict
from collections.abc import Callable

from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from protocol.clock import HapticClock
from protocol.messages import STICK, Choke, Strike, decode
from protocol.rate_limited_log import RateLimitedLog
from sound_server.receiving.arrival_statistics import ArrivalStatistics

TOO_LATE_NS = 50_000_000
# A strike that is due later than this beyond its latency comes from a clock that was mapped wrongly.
_IMPLAUSIBLE_NS = 500_000_000
_REMEMBERED = 4096
# What a drum stick can do, generously; beyond it the float32 mesh would overflow.
MAX_N = 1e4
_MAX_S = 1.0
_MAX_STROKE_M_PER_S = 1e3  # only a mallet's push grows with it


class Deduplicator:
    """The newest 4096 (boot, seq): a strike is played once, even when the network delivers it again; and a sample of
    its force by (boot, seq, tick)."""

    def __init__(self, remembered: int = _REMEMBERED) -> None:
        self._seen: OrderedDict[tuple[int, ...], None] = OrderedDict()
        self._remembered = remembered

    def is_new(self, *names: int) -> bool:
        """True the first time a name is given; it is known from then on."""
        if names in self._seen:
            return False
        self._seen[names] = None
        if len(self._seen) > self._remembered:
            self._seen.popitem(last=False)
        return True


class StrikeScheduler:
    """`on_boot` is called, on the reading thread, with the boot of every message.

    `note`: None, or who is told of each strike instead of the ring, because its force comes as a stream. `choke(s)` is
    called with the time, s, until the drum is to be choked.
    """

    def __init__(self, ring: StrikeRing, limited_log: RateLimitedLog, on_boot: Callable[[int], None]) -> None:
        self.ring = ring
        self._log_limited = limited_log
        self._on_boot = on_boot
        self._once = Deduplicator()
        self._chokes = Deduplicator()
        self.note: Callable[[Strike], None] | None = None
        self.choke: Callable[[float], None] = lambda _after_s: None
        self.clock: HapticClock | None = None
        self.latency_s = 0.0
        self.scene: Scene | None = None  # whose drum is struck; None: one that asks for no speed
        # How much of the latency is the trim's, which also holds for what sounds at once.
        self.trim_delay_s = 0.0
        self.arrivals = ArrivalStatistics()
        self.played = 0
        self.late = 0
        self.duplicates = 0
        self.refused = 0

    def take(self, payload: bytes, now_ns: int) -> None:
        """One message. Never raises for anything that a network can deliver."""
        try:
            strike = decode(payload, Strike)
            check(strike)
            stroke_m_per_s = stroke_of(strike, self.scene)
        except ValueError as error:
            self.refused += 1
            self._log_limited.warn(f"strike ignored: {error}")
            return
        is_played = strike.source != STICK
        if not is_played:
            self._on_boot(strike.boot)
        if not self._once.is_new(strike.boot, strike.seq):
            self.duplicates += 1
            return
        if self.note is not None and not is_played:  # a played strike comes without forces
            self._note_arrival(
                strike, now_ns, 0
            )  # its sound comes with its force, which has counters of its own
            self.note(strike)
            return
        onset_ns = self._onset(strike, now_ns)
        if onset_ns is None:
            self.late += 1
        elif self.ring.push(
            onset_ns,
            strike.x,
            strike.y,
            strike.peak_estimate_N,
            strike.contact_estimate_s,
            strike.impulse_N_s,
            stroke_m_per_s,
        ):
            self.played += 1
        else:
            self._log_limited.warn("strike dropped: 256 are waiting for the audio already")

    def take_choke(self, payload: bytes, now_ns: int) -> None:
        """One message of a choke, in order with the strikes: it ends what was struck before it. Never raises for
        anything that a network can deliver."""
        try:
            choke = decode(payload, Choke)
        except ValueError as error:
            self.refused += 1
            self._log_limited.warn(f"choke ignored: {error}")
            return
        if not self._chokes.is_new(choke.boot, choke.seq):
            self.duplicates += 1
            return
        # One that comes too late is wanted all the same: what it is to end may ring for seconds.
        onset_ns = self._onset(choke, now_ns) or now_ns
        self.choke(max(onset_ns - now_ns, 0) * 1e-9)

    def _onset(self, strike: Strike | Choke, now_ns: int) -> int | None:
        # Our time at which it is to sound, 0 for at once, None for too late. Without a clock for its boot nothing can
        # be said about its age, and it is played at once.
        latency_ns = round(self.latency_s * 1e9)
        contact_ns = self._note_arrival(strike, now_ns, latency_ns)
        if contact_ns is None:
            return self._at_once(now_ns)
        due_ns = contact_ns + latency_ns
        if now_ns > due_ns + TOO_LATE_NS:
            return None
        if latency_ns == 0 or due_ns > now_ns + latency_ns + _IMPLAUSIBLE_NS:
            return self._at_once(now_ns)
        return max(due_ns, 1)

    def _at_once(self, now_ns: int) -> int:
        return now_ns + round(self.trim_delay_s * 1e9) if self.trim_delay_s else 0

    def _note_arrival(self, strike: Strike | Choke, now_ns: int, latency_ns: int) -> int | None:
        # Our time of the contact; None without a clock of its boot. A played strike has its own, on the same clock.
        clock = self.clock
        if clock is None or (clock.boot != strike.boot and strike.source == STICK):
            return None
        contact_ns = clock.ours(strike.t_ns)
        self.arrivals.note(now_ns - contact_ns, latency_ns)
        return contact_ns


def check(strike: Strike) -> None:
    """ValueError, worded, for a strike that no stick can make."""
    if not 0.0 <= strike.peak_estimate_N <= MAX_N:
        raise ValueError(f"peak force {strike.peak_estimate_N:g} N is outside 0 .. {MAX_N:g} N")
    if not 0.0 <= strike.contact_estimate_s <= _MAX_S:
        raise ValueError(f"contact of {strike.contact_estimate_s:g} s is outside 0 .. {_MAX_S:g} s")
    if not abs(strike.impulse_N_s) <= MAX_N * _MAX_S:
        most_N_s = MAX_N * _MAX_S
        raise ValueError(f"impulse {strike.impulse_N_s:g} N s is outside -{most_N_s:g} .. {most_N_s:g} N s")
    if not (abs(strike.x) <= 1e3 and abs(strike.y) <= 1e3):
        raise ValueError(f"position {strike.x:g}, {strike.y:g} is nowhere near the head")


def stroke_of(strike: Strike, scene: Scene | None) -> float:
    """Speed of the scene's mallet, m/s; 0 for a drum that none strikes. ValueError, worded, for one that none has."""
    if scene is None or scene.mallet is None:
        return 0.0
    speed = scene.strike.stroke_at(strike.level, strike.z_speed_m_per_s)
    if not abs(speed) <= _MAX_STROKE_M_PER_S:
        raise ValueError(f"a mallet at {speed:g} m/s is faster than {_MAX_STROKE_M_PER_S:g} m/s")
    return speed
