"""Scheduling of Contact messages: checked, each tick's sample played once, at its instant, or dropped and counted.

A tick's force sounds `delay_s` after the tick: the scene's latency, or, where that is 0, three pieces and one block of
the audio device; plus the trim's delay. A piece is full after CONTACT_PIECE_S, the parabolas look two ticks ahead, a
block is rendered before it sounds; the rest is for the network. A contact whose beginning comes too late for that
sounds as soon as it can without gaps.
`ContactScheduler` is fed by the one thread that reads contacts; counters may be read from any.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable

import numpy as np

from drumstick.drum.excitation.feed import Feed, Forces
from drumstick.drum.memory.timeline import Stream
from protocol.clock import HapticClock
from protocol.messages import CONTACT_PIECE_S, Contact, Strike, decode
from protocol.rate_limited_log import RateLimitedLog
from sound_server.receiving.strikes import MAX_N, TOO_LATE_NS, Deduplicator

_PIECES = 3
_MIN_S = 0.001  # beside a block: from a piece's arrival to its sound, so that the next one comes in time
_IMPLAUSIBLE_NS = 200_000_000
_END_LOST_NS = 100_000_000  # after a contact's newest piece: its end will not come any more
_PLACES = 256
# In one message; and the rates that a servo may have.
_MAX_SAMPLES = 512
_RATES_HZ = (100.0, 48000.0)
_MAX_TICKS = 2**53


def own_delay_s(latency_s: float, block_s: float) -> float:
    """Delay from a tick to its sound without a trim, of a scene with this latency, in blocks of this length."""
    return latency_s if latency_s > 0.0 else _PIECES * CONTACT_PIECE_S + block_s


class ContactScheduler:
    """`on_boot` is called, on the reading thread, with the boot of every message."""

    def __init__(self, limited_log: RateLimitedLog, on_boot: Callable[[int], None]) -> None:
        self._log_limited = limited_log
        self._on_boot = on_boot
        self._feed: Feed | None = None
        self._ticks = Deduplicator(16384)
        self._contacts = Deduplicator()
        self._places: OrderedDict[tuple[int, int], tuple[float, float]] = OrderedDict()
        self._boots: list[int] = []  # oldest first; the last one plays
        self._newest = (0, 0)  # boot and last tick of the newest piece
        self._contact = (0, 0)  # its boot and seq
        self._choked: tuple[tuple[int, int], Feed] | None = None  # a contact that stays where it began
        self._pressed_until_ns = 0
        self.between_pieces = threading.Lock()  # held while a piece is read; never for long
        self._anchor = (0, 0.0, 0)  # first tick, period and instant, where no clock tells the instant
        self.clock: HapticClock | None = None
        self.latency_s = self.trim_delay_s = 0.0
        self._underflows_before = 0  # of the drums before this one
        self.played = 0
        self.late = 0
        self.duplicates = 0
        self.refused = 0

    def play_on(self, stream: Stream | None, latency_s: float, trim_delay_s: float = 0.0) -> None:
        """Play for this engine's stream from now on, with its scene's latency and the trim's delay; None: for none. Any
        thread."""
        self.latency_s, self.trim_delay_s = latency_s, trim_delay_s
        self._underflows_before = self.underflows
        self._feed = None if stream is None else Feed(stream)
        self._choked = None

    def move_on_to(self, stream: Stream | None) -> None:
        """Play for this stream, of a drum that is like the present one, from the next contact on. One that goes on
        stays with the drum that it began on. While `between_pieces` is held."""
        if self._feed is None or stream is None:
            return
        if self._choked is None or self._choked[0] != self._contact:
            self._choked = self._contact, self._feed
        self._underflows_before = self.underflows
        stream.state["block_ns"] = self._feed.stream.state["block_ns"]
        self._feed = Feed(stream)
        self._pressed_until_ns = 0

    @property
    def delay_s(self) -> float:
        """Delay from a tick to its sound."""
        block_s = self._feed.block_s if self._feed is not None else 0.0
        return own_delay_s(self.latency_s, block_s) + self.trim_delay_s

    def is_pressed(self, now_ns: int) -> bool:
        """True while a contact goes on: its newest piece ended within it, at most 0.1 s before our time `now_ns`."""
        return now_ns < self._pressed_until_ns

    @property
    def underflows(self) -> int:
        """Gaps in contacts that were bridged."""
        now = int(self._feed.stream.state["underflows"][0]) if self._feed is not None else 0
        return self._underflows_before + now

    def note(self, strike: Strike) -> None:
        """Note a contact's place, for pieces that do not say so. The thread that reads strikes."""
        self._places[strike.boot, strike.seq] = (strike.x, strike.y)
        if len(self._places) > _PLACES:
            self._places.popitem(last=False)

    def take(self, payload: bytes, now_ns: int) -> None:
        """One message. Never raises for anything that a network can deliver."""
        try:
            contact = decode(payload, Contact)
            forces = checked_forces(contact)
        except ValueError as error:
            self.refused += 1
            self._log_limited.warn(f"contact ignored: {error}")
            return
        self._on_boot(contact.boot)
        with self.between_pieces:
            self._schedule(contact, forces, now_ns)

    def _schedule(self, contact: Contact, forces: Forces, now_ns: int) -> None:
        feed = self._feed
        if feed is None:
            return
        if self._choked is not None and self._choked[0] == (contact.boot, contact.seq):
            feed = self._choked[1]
        if not self._is_present(contact.boot):
            self.late += 1
            return
        period_ns = 1e9 / contact.rate_Hz
        start_ns = self._start(contact, feed, period_ns, now_ns)
        if start_ns is None:
            self.late += 1
            return
        self._play(contact, forces, start_ns, period_ns, feed)

    def _is_present(self, boot: int) -> bool:
        # The servo that answers for the clock plays; before it has answered, the newest does. A piece of one that was
        # followed by another is from the past.
        if boot in self._boots and boot != self._boots[-1]:
            if self.clock is None or self.clock.boot != boot:
                return False
            self._boots.remove(boot)
        if boot not in self._boots:
            self._boots = [*self._boots[-15:], boot]
        return True

    def _start(self, contact: Contact, feed: Feed, period_ns: float, now_ns: int) -> int | None:
        # Our time at which its first tick begins to sound; None for too late.
        delay_ns = round(self.delay_s * 1e9)
        soonest_ns = now_ns + round((feed.block_s + _MIN_S) * 1e9)
        clock = self.clock
        if contact.t_ns is not None and clock is not None and clock.boot == contact.boot:
            due_ns = clock.ours(contact.t_ns) + delay_ns
            if now_ns > due_ns + TOO_LATE_NS:
                return None
            if due_ns < now_ns + delay_ns + _IMPLAUSIBLE_NS:
                return max(due_ns, soonest_ns)
        # Without a clock: as it comes, each piece after the one before.
        first, period_before_ns, instant_ns = self._anchor
        due_ns = instant_ns + round((contact.first_tick - first) * period_ns)
        if period_before_ns != period_ns or abs(due_ns - (now_ns + delay_ns)) > TOO_LATE_NS:
            due_ns = now_ns + delay_ns
            self._anchor = (contact.first_tick, period_ns, due_ns)
        return max(due_ns, soonest_ns)

    def _play(self, contact: Contact, forces: Forces, start_ns: int, period_ns: float, feed: Feed) -> None:
        # The samples that have not been heard yet; a message that comes twice, or overlaps another, adds nothing.
        x, y = contact.x, contact.y
        if x is None or y is None:
            x, y = self._places.get((contact.boot, contact.seq), (0.0, 0.0))
        new = [
            self._ticks.is_new(contact.boot, contact.seq, contact.first_tick + k) for k in range(len(forces))
        ]
        if not any(new):
            self.duplicates += 1
            return
        last = contact.first_tick + len(forces) - 1
        if contact.boot != self._newest[0] or last > self._newest[1]:  # none that was overtaken
            self._newest = (contact.boot, last)
            self._contact = (contact.boot, contact.seq)
            end_ns = start_ns + round(len(forces) * period_ns)
            self._pressed_until_ns = end_ns + _END_LOST_NS if forces[-1] != 0.0 else 0
        if self._contacts.is_new(contact.boot, contact.seq):
            self.played += 1
        edges = np.flatnonzero(np.diff([False, *new, False]))
        for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            first, instant_ns = contact.first_tick + begin, start_ns + round(begin * period_ns)
            taken = feed.push(contact.boot, first, instant_ns, period_ns, x, y, forces[begin:end])
            if not taken and feed is self._feed:  # one that is choked may have faded: nobody takes the rest
                self._log_limited.warn("contact dropped: 256 pieces are waiting for the audio already")


def checked_forces(contact: Contact) -> Forces:
    """The forces, N, float32; ValueError, worded, for a piece that no servo can tell."""
    low, high = _RATES_HZ
    if not low <= contact.rate_Hz <= high:
        raise ValueError(f"rate of {contact.rate_Hz:g} Hz is outside {low:g} .. {high:g} Hz")
    count = len(contact.forces) // 4
    if len(contact.forces) % 4 or not 1 <= count <= _MAX_SAMPLES:
        raise ValueError(
            f"{len(contact.forces)} bytes of forces: give 1 .. {_MAX_SAMPLES} float32, 4 bytes each"
        )
    for name, number in (("tick", contact.first_tick), ("boot", contact.boot), ("time", contact.t_ns or 0)):
        if not 0 <= number < (_MAX_TICKS if name == "tick" else 2**63):
            raise ValueError(f"{name} {number} is outside what a servo counts")
    if not (abs(contact.x or 0.0) <= 1e3 and abs(contact.y or 0.0) <= 1e3):
        raise ValueError(f"position {contact.x}, {contact.y} is nowhere near the head")
    forces = np.frombuffer(contact.forces, "<f4").astype(np.float32)
    wrong = ~(np.abs(forces) <= MAX_N)
    if wrong.any():
        raise ValueError(f"force {forces[wrong][0]:g} N is outside -{MAX_N:g} .. {MAX_N:g} N")
    return forces
