"""Figures of a device from its blocks and from strikes at known times: late blocks, shares, waits, delays. Pure."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from haptic_server.servo.stall_detector import without_host_stalls
from rig.machine.audio_advice import Delay, Row

Numbers = npt.NDArray[np.int64]


class StrikePath(NamedTuple):
    """Parts of a strike's way beside its wait for a block, ms: up to a tick of the force loop before it; interpolator
    and device after it. The scene's own latency, or a streamed force's, takes the place of tick and wait where it is
    longer.
    """

    tick_ms: float
    latency_ms: float
    device_ms: float

    def delay(self, waits_ms: npt.NDArray[np.float64]) -> Delay:
        """Delay of strikes that wait so long for their block."""
        ways = np.percentile(waits_ms, [1.0, 50.0, 99.0]) + self.tick_ms * np.array([0.0, 0.5, 1.0])
        return Delay(*(np.maximum(ways, self.latency_ms) + self.device_ms).tolist())


class Played(NamedTuple):
    """Observations of one run: blocks as load_meter.noted has them, times of strikes, the machine's stalls, from and
    to, ns; xruns; why the device stopped by itself, or empty; witnesses that did not get their priority."""

    blocks: Numbers
    struck: Numbers
    stalls: Numbers
    xruns: int
    lost: str
    witnesses_refused: tuple[str, ...] = ()


def newer(blocks: Numbers, since_ns: int) -> Numbers:
    """Blocks, of those that the sink noted, that began after since_ns; in order.

    A block that ended while they were copied stands in the place of the oldest: it is left for the next look.
    """
    begun = blocks[:, 0]
    return blocks[(begun > since_ns) & (begun <= begun[-1:].max(initial=0))]


def late_blocks(blocks: Numbers, period_ns: int, stalls: Numbers) -> tuple[int, int]:
    """Number of blocks that were not done when the next one was due; and without what these stalls explain.

    A block is due a period after the one before began: one that came late does not make the next late.
    """
    due = blocks[:-1, 0] + period_ns
    took = np.maximum(blocks[1:, 0] - due, 0) + blocks[1:, 1]
    ours = without_host_stalls(due, took, stalls)
    return int(np.sum(took > period_ns)), int(np.sum(ours > period_ns))


def waits_ms(blocks: Numbers, struck: Numbers) -> npt.NDArray[np.float64]:
    """Time from each strike to the beginning of the block that plays it; strikes after the last block are left out."""
    begun = blocks[:, 0]
    at = np.searchsorted(begun, struck)
    heard = at < len(begun)
    return (begun[at[heard]] - struck[heard]) * np.float64(1e-6)


def is_enough(played: Played) -> bool:
    """True when there are blocks to judge, and a strike that one of them played: a device may be lost before."""
    return len(played.blocks) >= 2 and len(waits_ms(played.blocks, played.struck)) > 0


def row_of(played: Played, block: int, rate_Hz: int, path: StrikePath, priority: str, granted: bool) -> Row:
    """Row of this block size, frames. `priority`: of the audio thread, as Scheduling.words; `granted`: by itself."""
    blocks = played.blocks
    period_ns = round(block / rate_Hz * 1e9)
    late, late_ours = late_blocks(blocks, period_ns, played.stalls)
    spent_ours = without_host_stalls(blocks[:, 0], blocks[:, 1], played.stalls)
    share_p50, share_p99, share_worst = (
        np.percentile(blocks[:, 1], [50.0, 99.0, 100.0]) / period_ns
    ).tolist()
    waits = waits_ms(blocks, played.struck)
    return Row(
        block=block,
        block_ms=1e-6 * period_ns,
        priority=priority,
        real_time=priority.startswith("SCHED_"),
        granted=granted,
        blocks=len(blocks),
        share_p50=share_p50,
        share_p99=share_p99,
        share_worst=share_worst,
        share_ours_p99=float(np.percentile(spent_ours, 99.0)) / period_ns,
        late=late,
        late_ours=late_ours,
        xruns=played.xruns,
        xruns_ours=max(0, played.xruns - (late - late_ours)),  # an excused block may have been one
        waited_ms=float(np.percentile(waits, 99.0)) + path.tick_ms,
        device_ms=path.device_ms,
        delay_ms=path.delay(waits),
        lost=played.lost,
    )
