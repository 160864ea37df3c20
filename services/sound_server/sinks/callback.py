"""The audio device's callback, compiled: PortAudio's thread calls it without Python and without the GIL.

It gets the address of a mixer's buffers and of the counters that it keeps up to date; which drums sound is the mixer's.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from numba.np.numpy_support import carray

from realtime.clock import now_ns
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.handover import ForeignHandle, load_from_address
from realtime.kernels.jit import cfunction, njit
from realtime.records import Records
from sound_server.mixer import MixBuffers, Mixer
from sound_server.sinks.load_meter import timed_block
from sound_server.sinks.sink import SINK_COUNTERS, SinkCounters

_array: Any = carray  # numba knows it by value; its own annotations do not fit addresses
_UNDERFLOW = 0x4  # paOutputUnderflow
_PULL = 0.02  # how much of a block's lateness moves the expected time of the next: jitter out, drift in
_LOST_NS = 20_000_000
_ASIDE = 7  # all blocks of so many blocks' time on one side of what was expected: that is no jitter


@njit()
def block_start(counters: Records, now: int, frames: int) -> int:
    """Start of this block by the device's steady clock, from callbacks that come with jitter, or several at a time. A
    device that stood still for less than _LOST_NS goes on later from then on: it is followed after _ASIDE blocks' time.
    Audio thread."""
    counts: SinkCounters = counters[0]
    period_ns = int(frames * 1e9 / counts.rate_Hz)
    error = now - counts.expected_ns
    shift = int(_PULL * error)
    if abs(error) > _LOST_NS:
        shift = error
        counts.aside_since_ns = 0
    elif counts.aside_since_ns == 0 or (error > 0) != (counts.least_aside_ns > 0):
        counts.aside_since_ns, counts.least_aside_ns = now, error
    else:
        if abs(error) < abs(counts.least_aside_ns):
            counts.least_aside_ns = error
        if now - counts.aside_since_ns >= _ASIDE * period_ns:
            shift = counts.least_aside_ns
            counts.aside_since_ns = 0
    counts.least_aside_ns -= shift
    start = counts.expected_ns + shift
    counts.expected_ns = start + period_ns
    return start


@njit()
def fill(
    buffers: MixBuffers,
    counters: Records,
    out: npt.NDArray[np.float32],
    flags: int,
    clock: npt.NDArray[np.int64],
) -> None:
    """One callback's work. Audio thread; no allocation, no locks."""
    buffers = borrowed_view(buffers)
    if flags & _UNDERFLOW:
        counters[0].xruns += 1
    mode = flush_denormals()
    timed_block(buffers, counters, out, block_start(counters, now_ns(clock), out.shape[0]), clock)
    restore(mode)


def _handed(mixer: Mixer, counters: Records) -> ForeignHandle:
    return ForeignHandle((mixer.buffers, counters, np.zeros(2, np.int64)))


_KIND = _handed(Mixer(48000), np.zeros(1, SINK_COUNTERS)).kind


@cfunction("int32(voidptr, voidptr, uint64, voidptr, uint64, voidptr)", cache=False)
def stream_callback(_input: Any, output: Any, frames: Any, _time: Any, flags: Any, address: Any) -> int:
    """PaStreamCallback; returns paContinue."""
    buffers, counters, clock = load_from_address(address, _KIND)
    out: npt.NDArray[np.float32] = _array(output, (int(frames), counters[0].channels), np.float32)
    fill(buffers, counters, out, int(flags), clock)
    return 0


class CallbackData:
    """Memory that the callback reads. It must live as long as the stream; `counters` is (1,) of SINK_COUNTERS."""

    def __init__(self, mixer: Mixer, counters: Records) -> None:
        self._handed = _handed(mixer, counters)

    @property
    def address(self) -> int:
        """The userdata of the callback."""
        return self._handed.address
