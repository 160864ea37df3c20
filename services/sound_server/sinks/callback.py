"""The audio device's callback, compiled: PortAudio's thread calls it without Python and without the GIL.

It gets the address of a few cells. Two seats take an engine each; `cells[SEAT]` names the one that plays, so that the
main thread can prepare another in the empty seat and switch between two blocks. Engines of different scenes are of
different types: with each comes the address of the function that was compiled for it.
"""

import functools
from typing import Any

import numpy as np
import numpy.typing as npt
from numba.np.numpy_support import carray

from realtime.atomics import load_acquire, poke
from realtime.clock import now_ns
from realtime.float_mode import flush_denormals, restore
from realtime.foreign import call_block
from realtime.handover import Handed, take_up
from realtime.jit import CFunction, Record, Records, cfunction, njit
from realtime.lent import lend
from sound_server.engine import Engine
from sound_server.sinks.timed import timed_block

SEAT, _CHANNELS = 0, 1
_FIRST_SEAT = 2  # each seat: the function's address, and its argument's
_CELLS = 6
_NOBODY = -1
_array: Any = carray  # numba knows it by value; its own annotations do not fit addresses
_UNDERFLOW = 0x4  # paOutputUnderflow
_PULL = 0.02  # how much of a block's lateness moves the expected time of the next: jitter out, drift in
_LOST_NS = 20_000_000


@njit()
def block_start(desk: Records, now: int, frames: int) -> int:
    """When this block began by the device's steady clock, from callbacks that come with jitter. Audio thread."""
    counts: Record = desk[0]
    error = now - counts.expected_ns
    start = now if abs(error) > _LOST_NS else counts.expected_ns + int(_PULL * error)
    counts.expected_ns = start + int(frames * 1e9 / counts.rate_Hz)
    return start


@njit()
def fill(
    engine: Engine, desk: Records, out: npt.NDArray[np.float32], flags: int, clock: npt.NDArray[np.int64]
) -> None:
    """One callback's work. Audio thread; no allocation, no locks."""
    if flags & _UNDERFLOW:
        desk[0].xruns += 1
    mode = flush_denormals()
    timed_block(engine, desk, out, block_start(desk, now_ns(clock), out.shape[0]), clock)
    restore(mode)


@functools.cache
def _compiled(kind: Any) -> CFunction:
    # The parts are compiled and cached on their own; this closure over them is small and compiled in each process.
    @cfunction("void(voidptr, voidptr, int64, int64)", cache=False)
    def play(argument: Any, output: Any, frames: int, flags: int) -> None:
        taken, desk, clock, channels = take_up(argument, kind)
        out: npt.NDArray[np.float32] = _array(output, (frames, channels[0]), np.float32)
        fill(lend(taken), desk, out, flags, clock)

    return play


@cfunction("int32(voidptr, voidptr, uint64, voidptr, uint64, voidptr)")
def stream_callback(_input: Any, output: Any, frames: Any, _time: Any, flags: Any, cells_address: Any) -> int:
    """PaStreamCallback; returns paContinue."""
    cells: npt.NDArray[np.int64] = _array(cells_address, (_CELLS,), np.int64)
    seat: Any = load_acquire(cells, SEAT)
    if seat == _NOBODY:
        out: npt.NDArray[np.float32] = _array(output, (int(frames) * cells[_CHANNELS],), np.float32)
        out[:] = np.float32(0.0)
        return 0
    at = _FIRST_SEAT + 2 * seat
    call_block(cells[at], cells[at + 1], output, frames, flags)
    return 0


class Seats:
    """What the callback reads. It must live as long as the stream; `desk` is (1,) of DESK."""

    def __init__(self, desk: Records, channels: int) -> None:
        self._cells = np.zeros(_CELLS, np.int64)
        self._cells[SEAT] = _NOBODY
        self._cells[_CHANNELS] = channels
        self._channels = np.array([channels], np.int64)
        self._clock = np.zeros(2, np.int64)
        self._desk = desk
        self._seated: list[tuple[Handed, CFunction] | None] = [None, None]

    @property
    def address(self) -> int:
        """The userdata of the callback."""
        return int(self._cells.ctypes.data)

    def seat(self, engine: Engine) -> None:
        """Let `engine` play from the next block on. Main thread; seconds where its kernels must compile.

        Call again only after a block has been played: the seat it takes then is that of the engine before.
        """
        free = 1 - max(int(self._cells[SEAT]), 0)
        handed = Handed((engine, self._desk, self._clock, self._channels))
        function = _compiled(handed.kind)
        self._seated[free] = (handed, function)
        self._cells[_FIRST_SEAT + 2 * free] = function.address
        self._cells[_FIRST_SEAT + 2 * free + 1] = handed.address
        poke(self._cells, SEAT, free)
