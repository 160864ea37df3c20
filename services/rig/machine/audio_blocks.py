"""Figures of a device from its blocks and from strikes at known times: late blocks, shares, waits, delays. Pure."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drumstick.drum.calibrate import full_scale
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.parameters.scene import Scene
from haptic_server.servo.stall_detector import without_host_stalls
from rig.machine.audio_advice import Delay, Row

_ANGLE = math.pi * (3.0 - math.sqrt(5.0))  # between strikes: no two fall on one place
Numbers = npt.NDArray[np.int64]


def blows(scene: Scene) -> Iterator[OfflineStrike]:
    """The hardest strike of the scene, again and again, round the head."""
    hardest, angle = full_scale(scene), 0.0
    radius = math.hypot(hardest.x, hardest.y)
    while True:
        yield replace(hardest, x=radius * math.cos(angle), y=radius * math.sin(angle))
        angle += _ANGLE


@dataclass(frozen=True)
class StrikePath:
    """Parts of a strike's way beside its wait for a block, ms: up to a tick of the force loop, then the mesh's
    interpolator, and the device. The scene's own latency, or a streamed force's, takes the place of tick and wait where
    it is longer.
    """

    tick_ms: float
    latency_ms: float
    interpolator_ms: float
    device_ms: float

    def delay(self, waits_ms: npt.NDArray[np.float64]) -> Delay:
        """Delay of strikes that wait so long for their block."""
        ticks_ms = self.tick_ms * np.array([0.0, 0.5, 1.0])
        ways = np.percentile(waits_ms, [1.0, 50.0, 99.0]) + ticks_ms
        least, typical, most = np.maximum(ways, self.latency_ms) + self.interpolator_ms + self.device_ms
        return Delay(float(least), float(typical), float(most))


@dataclass(frozen=True)
class Played:
    """Observations of one run: blocks as load_meter.noted has them, times of strikes, the machine's stalls, from and
    to, ns; xruns; why the device stopped by itself, or empty."""

    blocks: Numbers
    struck: Numbers
    stalls: Numbers
    xruns: int
    lost: str


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


def row_of(played: Played, block: int, rate_Hz: int, path: StrikePath, priority: str, granted: bool) -> Row:
    """Row of this block size, frames. `priority`: of the audio thread, as Scheduling.words; `granted`: by itself."""
    blocks, stalls = played.blocks, played.stalls
    period_ns = round(block / rate_Hz * 1e9)
    late, late_ours = late_blocks(blocks, period_ns, stalls)
    share = blocks[:, 1] / period_ns
    share_ours = without_host_stalls(blocks[:, 0], blocks[:, 1], stalls) / period_ns
    waits = waits_ms(blocks, played.struck)
    return Row(
        block=block,
        block_ms=1e-6 * period_ns,
        priority=priority,
        real_time=priority.startswith("SCHED_"),
        granted=granted,
        blocks=len(blocks),
        share_p50=float(np.percentile(share, 50.0)),
        share_p99=float(np.percentile(share, 99.0)),
        share_worst=float(share.max()),
        share_ours_p99=float(np.percentile(share_ours, 99.0)),
        late=late,
        late_ours=late_ours,
        xruns=played.xruns,
        xruns_ours=max(0, played.xruns - (late - late_ours)),  # an excused block may have been one
        host_stalls=len(stalls),
        longest_host_stall_ms=1e-6 * float((stalls[:, 1] - stalls[:, 0]).max(initial=0)),
        waited_ms=float(np.percentile(waits, 99.0)) + path.tick_ms,
        device_ms=path.interpolator_ms + path.device_ms,
        delay_ms=path.delay(waits),
        lost=played.lost,
    )
