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
_JACK = f"jackd -R -P {PRIORITY}"
# A strike comes at any moment of a block, so the delays of two may differ by a block; this evens it out.
_EVENED_BY = "[drum] latency_s"
STREAMED = (
    "this scene's drum sounds by the streamed force: its delay is counted, the force's own load is not. The test"
    " strikes the drum with blows; leave room for it"
)
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
    host_stalls: int
    longest_host_stall_ms: float
    waited_ms: float
    device_ms: float
    delay_ms: Delay
    lost: str = ""

    @property
    def fits(self) -> bool:
        """True when this block can be played with."""
        return (
            not self.lost
            and self.share_ours_p99 <= MAX_SHARE
            and self.late_ours == 0
            and self.xruns_ours == 0
        )


@dataclass(frozen=True)
class Advice:
    """The row to play with, or None; in words what to do, and what its delay means."""

    row: Row | None
    words: tuple[str, ...]
    perceived: tuple[str, ...]


def _smallest(rows: Sequence[Row]) -> Row | None:
    return min((row for row in rows if row.fits), key=lambda row: row.block, default=None)


def _priority(rows: Sequence[Row], chosen: Row | None, granted: int, can_be_had: bool) -> str:
    if granted:
        if chosen is not None and not chosen.real_time:
            return "only an ordinary audio thread fits: see real-time throttling in drumstick doctor"
        if granted >= FIFO_PRIORITY:
            return f"priority: {granted} is not below the force loop's {FIFO_PRIORITY}: start JACK as {_JACK}"
        return f"priority: real time ({granted}), as it should be"
    if not can_be_had:
        return (
            "priority: real time, which cannot be had here or is not known to be. For who logs in:"
            f" {LIMITS}; then log in again, and test again"
        )
    with_it = _smallest([row for row in rows if row.real_time])
    fits = "no block fits with it either" if with_it is None else f"block {with_it.block} fits with it"
    return (
        f"priority: give real time; {fits}. The sound server's thread has none on this device: a sound card by ALSA"
        f" gives it, and JACK started as {_JACK}"
    )


def _lost(rows: Sequence[Row], untried: Sequence[int]) -> str:
    # Empty where the device went on.
    lost = ", ".join(dict.fromkeys(f"{row.block} ({row.lost})" for row in rows if row.lost))
    if not lost:
        return ""
    left = f"; not tried: {', '.join(str(block) for block in untried)}" if untried else ""
    return f"the device was lost at block {lost}{left}"


def advise(
    rows: Sequence[Row], granted: int, can_be_had: bool, latency_s: float, untried: Sequence[int] = ()
) -> Advice:
    """The smallest block that fits as the sound server plays; else one that fits at the other priority.

    granted: real-time priority of the sound server's audio thread, 0 for none; can_be_had: it may have one. latency_s:
    the scene's own. untried: blocks that were not tried, since the device was lost.
    """
    own = _smallest([row for row in rows if row.granted])
    chosen = own or _smallest(rows)
    priority = _priority(rows, chosen, granted, can_be_had)
    lost = _lost(rows, untried)
    if chosen is None and lost:
        return Advice(None, (f"{lost}: see to it, and test again", priority), ())
    if chosen is None:
        none = "no block fits: the drum takes too long here, or other programs disturb it"
        what = "stop those, or choose a scene with a lighter drum (drumstick scene cost)"
        return Advice(None, (f"{none}; {what}", priority), ())
    how = "" if own else ", with real-time priority" if chosen.real_time else ", without real-time priority"
    words = [f"play with --audio-block {chosen.block} ({chosen.block_ms:.1f} ms){how}", priority]
    if lost:
        words.append(lost)
    larger = sorted(
        {row.block for row in rows if row.granted and row.block > chosen.block and not (row.fits or row.lost)}
    )
    if own and larger:
        listed = ", ".join(str(block) for block in larger)
        words.append(
            f"larger blocks did not fit ({listed}): something disturbed the test; make it longer (--seconds)"
        )
    return Advice(chosen, tuple(words), perceived(chosen, latency_s))


def perceived(row: Row, latency_s: float = 0.0) -> tuple[str, ...]:
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
    begin = f"it varies by {spread_ms:.1f} ms"
    if spread_ms <= goal_ms:
        return f"{begin}, within the goal of {goal_ms:g} ms (Wessel and Wright, 2002)"
    even_ms = math.ceil(row.waited_ms + _MESSAGE_MS)
    even = f"{_EVENED_BY} = {1e-3 * even_ms:g} makes it even, at {even_ms + row.device_ms:.1f} ms"
    if latency_s > 0.0:
        even = f"the scene's {_EVENED_BY} = {latency_s:g} is too short for this block; {even}"
    if 0.5 * spread_ms < either_ms:
        goal = f"more than the goal of {goal_ms:g} ms (Wessel and Wright, 2002)"
        return (
            f"{begin}: {goal}, less than the +- {either_ms:g} ms that were rated worse (Jack, 2018); {even}"
        )
    return f"{begin}, as much as the +- {either_ms:g} ms that were rated worse (Jack, 2018); {even}"
