"""Advice of `drumstick audio-test`: which block and priority, and what the delay means to who plays. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from drumstick.perception import jnd
from haptic_server.servo.priority import FIFO_PRIORITY
from rig.machine.real_time import LIMITS

BLOCKS = (32, 64, 128, 256, 512, 1024)  # frames, tried where none is asked for
# Of a block's time: the rest is for what the test has not, such as the page's pictures and other programs.
MAX_SHARE = 0.7
# Below the force loop, which must never wait for the sound; above everything that has no deadline.
PRIORITY = FIFO_PRIORITY - 10
_JACK = f"start JACK as jackd -R -P {PRIORITY}"
_MESSAGE_MS = 1.0  # from the servo to the sound server, on one machine


@dataclass(frozen=True)
class Delay:
    """From a strike to its sound at the device, ms: the soonest, the usual and the latest of a hundred.

    At most: a device's time is counted to the last frame of the strike's block, `null`'s to the first.
    """

    least: float
    typical: float
    most: float


@dataclass(frozen=True)
class Row:
    """One block size at one priority. Shares are of a block's time. Late: blocks that were not done when the next one
    was due; `late_ours`, `xruns_ours` and `share_ours_p99` are without what the machine's own stalls explain.

    priority: of the audio thread, in words; granted: as the sound server gets it. waited_ms: from a strike to the block
    that plays it, of 99 in 100 at most; device_ms: from there to the device. lost: why the device stopped by itself.
    """

    block: int
    block_ms: float
    priority: str
    real_time: bool
    granted: bool
    blocks: int
    share_p50: float
    share_p99: float
    share_worst: float
    share_ours_p99: float
    late: int
    late_ours: int
    xruns: int
    xruns_ours: int
    waited_ms: float
    device_ms: float
    delay_ms: Delay
    lost: str = ""

    @property
    def fits(self) -> bool:
        """True when this block can be played with."""
        return not (self.lost or self.late_ours or self.xruns_ours) and self.share_ours_p99 <= MAX_SHARE


def _smallest(rows: Sequence[Row]) -> Row | None:
    return min((row for row in rows if row.fits), key=lambda row: row.block, default=None)


def _priority(rows: Sequence[Row], chosen: Row | None, granted: int) -> str:
    if granted and chosen is not None and not chosen.real_time:
        return "only an ordinary audio thread fits: see real-time throttling in drumstick doctor"
    if granted >= FIFO_PRIORITY:
        return f"priority: {granted} is not below the force loop's {FIFO_PRIORITY}: {_JACK}"
    if granted:
        return f"priority: real time ({granted}), as it should be"
    others = [row for row in rows if row.real_time]
    if not others:
        return (
            "priority: real time, which cannot be had here or is not known to be. For who logs in:"
            f" {LIMITS}; then log in again, and test again"
        )
    with_it = _smallest(others)
    fits = f"block {with_it.block} fits with it" if with_it else "no block fits with it either"
    return f"priority: give real time; {fits}. The sound server has none on this device: by ALSA it has, or {_JACK}"


def advise(rows: Sequence[Row], granted: int) -> tuple[Row | None, list[str]]:
    """The smallest block that fits as the sound server plays; else one that fits at the other priority; what to do.

    granted: real-time priority of the sound server's audio thread, 0 for none.
    """
    own = _smallest([row for row in rows if row.granted])
    chosen = own or _smallest(rows)
    priority = _priority(rows, chosen, granted)
    lost = ", ".join(dict.fromkeys(f"{row.block} ({row.lost})" for row in rows if row.lost))
    lost = f"the device was lost at block {lost}: see to it, and test again" if lost else ""
    if chosen is None:
        none = (
            "no block fits: the drum takes too long here, or other programs disturb it; stop those, or choose a"
            " scene with a lighter drum (drumstick scene cost)"
        )
        return None, [lost or none, priority]
    how = "" if own else f", with{'' if chosen.real_time else 'out'} real-time priority"
    words = [f"play with --audio-block {chosen.block} ({chosen.block_ms:.1f} ms){how}", priority, lost]
    larger = [
        row.block for row in rows if row.granted and row.block > chosen.block and not (row.fits or row.lost)
    ]
    if own and larger:
        listed = ", ".join(map(str, sorted(larger)))
        words.append(
            f"larger blocks did not fit ({listed}): something disturbed the test; make it longer (--seconds)"
        )
    return chosen, list(filter(None, words))


def perceived(row: Row, latency_s: float = 0.0) -> tuple[str, str]:
    """Meaning of this delay and its spread to percussionists; sources: drumstick.perception.jnd."""
    return (_delay_words(row.delay_ms.typical), _spread_words(row, latency_s))


def _delay_words(typical_ms: float) -> str:
    like_none, worse, told = 1e3 * jnd.LATENCY_LIKE_NONE_s, 1e3 * jnd.LATENCY_WORSE_s, 1e3 * jnd.LATENCY_s
    begin = f"{typical_ms:.1f} ms from strike to sound: percussionists rated"
    if typical_ms <= like_none:
        return f"{begin} {like_none:g} ms like none (Jack, 2018)"
    if typical_ms < worse:
        return f"{begin} {like_none:g} ms like none and {worse:g} ms worse (Jack, 2018); this is between"
    heard = f"; from {told:g} ms tap and sound are told apart (Adelstein, 2003)" if typical_ms >= told else ""
    return f"{begin} {worse:g} ms worse than none (Jack, 2018){heard}"


def _spread_words(row: Row, latency_s: float) -> str:
    spread_ms = row.delay_ms.most - row.delay_ms.least
    goal_ms, either_ms = 1e3 * jnd.LATENCY_SPREAD_GOAL_s, 1e3 * jnd.LATENCY_SPREAD_s
    goal = f"the goal of {goal_ms:g} ms (Wessel and Wright, 2002)"
    rated = f"the +- {either_ms:g} ms that were rated worse (Jack, 2018)"
    if spread_ms <= goal_ms:
        return f"it varies by {spread_ms:.1f} ms, within {goal}"
    meaning = f"more than {goal}, less than {rated}" if 0.5 * spread_ms < either_ms else f"as much as {rated}"
    # A strike comes at any moment of a block, so the delays of two may differ by a block; a latency evens that out.
    even_ms = math.ceil(row.waited_ms + _MESSAGE_MS)
    short = f"; the scene's latency_s = {latency_s:g} is too short for this block" if latency_s > 0.0 else ""
    return (
        f"it varies by {spread_ms:.1f} ms, {meaning}{short}; [drum] latency_s = {1e-3 * even_ms:g} makes it even,"
        f" at {even_ms + row.device_ms:.1f} ms"
    )
