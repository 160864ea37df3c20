"""The audio device's callback, compiled: PortAudio's thread calls it without Python and without the GIL.

It gets a table of addresses. Two seats take an engine each; `cells[SEAT]` names the one that plays, so that the main
thread can prepare another in the empty seat and switch between two blocks.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from numba.np.numpy_support import carray

from realtime.atomics import load_acquire, poke
from realtime.clock import now_ns
from realtime.float_mode import flush_denormals, restore
from realtime.jit import Record, Records, cfunction, njit
from sound_server.engine import CONTROL, METERS, Engine
from sound_server.events import EVENT
from sound_server.excitation import PULSE
from sound_server.sinks.sink import DESK
from sound_server.sinks.timed import timed_block
from sound_server.upsample import TAPS

SEAT = 0
_array: Any = carray  # numba knows it by value; its own annotations do not fit addresses
_NOBODY = -1
_FIELDS = len(Engine._fields)
_SEAT_SIZE = _FIELDS + 1  # an engine's arrays, and their lengths
_CELLS, _DESK, _CLOCK, _CHANNELS = (2 * _SEAT_SIZE + i for i in range(4))
_TABLE_SIZE = 2 * _SEAT_SIZE + 4
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


@cfunction("int32(voidptr, CPointer(float32), uint64, voidptr, uint64, CPointer(voidptr))")
def stream_callback(_input: Any, output: Any, frames: Any, _time: Any, flags: Any, table_address: Any) -> int:
    """PaStreamCallback; returns paContinue."""
    table: Any = _array(table_address, (_TABLE_SIZE,))
    cells: npt.NDArray[np.int64] = _array(table[_CELLS], (1,), np.int64)
    channels: npt.NDArray[np.int64] = _array(table[_CHANNELS], (1,), np.int64)
    out: npt.NDArray[np.float32] = _array(output, (int(frames), channels[0]))
    seat: Any = load_acquire(cells, SEAT)
    if seat == _NOBODY:
        out[:] = np.float32(0.0)
        return 0
    at = seat * _SEAT_SIZE
    n: npt.NDArray[np.int64] = _array(table[at + _FIELDS], (_FIELDS,), np.int64)
    engine = Engine(
        _array(table[at], (n[0],), CONTROL),
        _array(table[at + 1], (n[1],), METERS),
        _array(table[at + 2], (2, n[2] // 2), np.float32),
        _array(table[at + 3], (n[3],), np.float32),
        _array(table[at + 4], (n[4] // 2, 2), np.int32),
        _array(table[at + 5], (n[5],), PULSE),
        _array(table[at + 6], (n[6],), np.int64),
        _array(table[at + 7], (n[7] // 2, 2), np.float32),
        _array(table[at + 8], (n[8] // TAPS, TAPS), np.float32),
        _array(table[at + 9], (2, n[9] // 2), np.float32),
        _array(table[at + 10], (n[10],), EVENT),
        _array(table[at + 11], (n[11],), np.int64),
        _array(table[at + 12], (n[12],), EVENT),
    )
    desk: Records = _array(table[_DESK], (1,), DESK)
    clock: npt.NDArray[np.int64] = _array(table[_CLOCK], (2,), np.int64)
    fill(engine, desk, out, int(flags), clock)
    return 0


class AddressTable:
    """What the callback reads. It must live as long as the stream; `desk` is (1,) of DESK."""

    def __init__(self, desk: Records, channels: int) -> None:
        self._cells = np.full(1, _NOBODY, np.int64)
        self._channels = np.array([channels], np.int64)
        self._clock = np.zeros(2, np.int64)
        self._desk = desk
        self._table = np.zeros(_TABLE_SIZE, np.int64)
        self._seated: list[tuple[Engine, npt.NDArray[np.int64]] | None] = [None, None]
        for place, array in (
            (_CELLS, self._cells),
            (_DESK, desk),
            (_CLOCK, self._clock),
            (_CHANNELS, self._channels),
        ):
            self._table[place] = array.ctypes.data

    @property
    def address(self) -> int:
        """The userdata of the callback."""
        return int(self._table.ctypes.data)

    def seat(self, engine: Engine) -> None:
        """Let `engine` play from the next block on. Main thread; call again only after a block has been played, for
        the seat it takes then is that of the engine before."""
        free = 1 - max(int(self._cells[SEAT]), 0)
        lengths = np.array([array.size for array in engine], np.int64)
        self._seated[free] = (engine, lengths)
        at = free * _SEAT_SIZE
        for i, array in enumerate(engine):
            if not array.flags.c_contiguous:
                raise ValueError(f"{Engine._fields[i]} is not contiguous")
            self._table[at + i] = array.ctypes.data
        self._table[at + _FIELDS] = lengths.ctypes.data
        poke(self._cells, SEAT, free)
