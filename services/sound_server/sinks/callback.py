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
_ASIDE = 8  # so many blocks in a row on one side of what was expected are no jitter


@njit()
def block_start(counters: Records, now: int, frames: int) -> int:
    """Start of this block by the device's steady clock, from callbacks that come with jitter. A device that stood still
    for less than _LOST_NS goes on later from then on: after _ASIDE blocks it is followed at once. Audio thread."""
    counts: SinkCounters = counters[0]
    error = now - counts.expected_ns
    if abs(error) > _LOST_NS:
        shift = error
        counts.aside = 0
    else:
        if counts.aside == 0 or (error > 0) != (counts.least_aside_ns > 0):
            counts.aside, counts.least_aside_ns = 0, error
        elif abs(error) < abs(counts.least_aside_ns):
            counts.least_aside_ns = error
        counts.aside += 1
        shift = int(_PULL * error)
        if counts.aside == _ASIDE:
            shift = counts.least_aside_ns
            counts.aside = 0
        counts.least_aside_ns -= shift
    start = counts.expected_ns + shift
    counts.expected_ns = start + int(frames * 1e9 / counts.rate_Hz)
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
