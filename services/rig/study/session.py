"""A session as it is played: block after block, the metronome's clicks, and every strike into the log.

One thread. It sleeps until a click is due, and meanwhile writes what was heard. The asynchrony does not depend on how
punctual it is: each click is a strike of the rig itself, whose instant the rig tells on the clock of all strikes.
"""

import time
from collections.abc import Callable

from protocol.clock import HapticClock
from protocol.messages import Strike as Heard
from protocol.messages import decode
from realtime.stop import StopRequest
from rig.exit_status import unavailable
from rig.study.rig_link import METRONOME, RigLink
from rig.study.session_log import Begin, Click, End, SessionLog, Strike
from rig.study.task import Block, Task

_LEAD_S = 1.0  # from the announcement to the first click
_GRACE_S = 0.3  # for strikes that are under way at a block's end
_TURN_S = 0.02


class _Stopped(Exception):
    pass


class Received:
    """Strikes of one block, as they come off the wire: each once, those of the metronome left out."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._seen: dict[int, set[int]] = {}  # numbers by boot; they may overtake each other
        self.unreadable = 0

    @property
    def lost(self) -> int:
        """Strikes whose numbers are missing between those that came."""
        return sum(max(seen) - min(seen) + 1 - len(seen) for seen in self._seen.values())

    def strike(self, payload: bytes) -> Strike | None:
        """The strike to log, if it is one."""
        try:
            heard = decode(payload, Heard)
        except ValueError:
            self.unreadable += 1
            return None
        seen = self._seen.setdefault(heard.boot, set())
        is_known = heard.seq in seen
        seen.add(heard.seq)
        if heard.source == METRONOME or is_known:
            return None
        counts = heard.source == self._source or heard.source.startswith(f"{self._source} ")
        # Only the way: the rest of a source may be a machine's address, or a person's name.
        way = heard.source.partition(" ")[0]
        return Strike(heard.t_ns, heard.x, heard.y, heard.level, heard.z_speed_m_per_s, way, counts)


class StudySession:
    """Plays what is left of a session. `say` hears what the player is to do."""

    def __init__(
        self, link: RigLink, log: SessionLog, task: Task, stop: StopRequest, say: Callable[[str], None]
    ) -> None:
        self._link, self._log, self._task, self._stop, self._say = link, log, task, stop, say
        self._received: Received | None = None  # None between blocks: nothing is logged

    def run(self) -> bool:
        """Play every block that the log has not; False when somebody stopped it. Raises CommandError, OSError."""
        try:
            for number, block in enumerate(self._task.block, 1):
                if number not in self._log.whole:
                    self._block(number, block)
        except _Stopped:
            return False
        finally:
            self._write_heard()
        return True

    def _block(self, number: int, block: Block) -> None:
        self._say(
            f"Block {number} of {len(self._task.block)}, {block.name}: {block.condition}. {_words(block)}"
        )
        self._wait(time.monotonic_ns() + round(block.rest_s * 1e9))
        clock, scene = self._link.clock(), self._link.scene()
        interval_ns = round((block.interval_s or 0.0) * 1e9)
        clicks = block.clicks()
        first_ns = time.monotonic_ns() + round(_LEAD_S * 1e9) - min([0, *clicks]) * interval_ns
        self._log.write(Begin(number, self._log.next_attempt(number), clock.haptic(first_ns), scene))
        self._write_heard()  # what came before is passed over
        self._received = received = Received(block.source)
        for strike in clicks:
            self._click(strike, first_ns + strike * interval_ns, clock)
        if not clicks:
            self._wait(first_ns)
            self._say("Play.")
        self._wait(first_ns + round((block.seconds + _GRACE_S) * 1e9))
        if self._link.clock().boot != clock.boot:
            unavailable(f"the rig began anew in block {number}, which is left off: run it again to go on")
        self._write_heard()
        self._received = None
        meter = self._link.meter()
        lags = (None, None) if meter is None else (meter.arrival_ms, meter.latency_ms)
        self._log.write(End(number, received.lost, received.unreadable, *lags))
        self._log.sync()

    def _click(self, strike: int, due_ns: int, clock: HapticClock) -> None:
        self._wait(due_ns)
        self._log.write(Click(strike, clock.haptic(due_ns), self._link.click(self._task)))

    def _wait(self, due_ns: int) -> None:
        # Until our monotonic clock says so; writes what is heard meanwhile. A stop is heard where it is late, too.
        if self._stop.is_set():
            raise _Stopped
        while (left_s := (due_ns - time.monotonic_ns()) * 1e-9) > 0.0:
            if self._stop.is_set():
                raise _Stopped
            time.sleep(min(left_s, _TURN_S))
            self._write_heard()

    def _write_heard(self) -> None:
        while not self._link.heard.empty():
            payload = self._link.heard.get()
            strike = self._received.strike(payload) if self._received is not None else None
            if strike is not None:
                self._log.write(strike)


def _words(block: Block) -> str:
    length = f"{block.seconds:g} s"
    if block.interval_s is None:
        return f"At your own rate, {length}."
    rate = f"{60.0 / block.interval_s:g} strikes a minute, {block.count} strikes, {length}"
    lead = {
        "throughout": "with the metronome",
        "stops": f"with the metronome for {block.sounded} strikes, then on without it",
        "none": "without the metronome",
    }[block.metronome]
    return f"{rate}, {lead}; {block.counted_in} clicks count you in."
