"""Mixer of all sounding drums, side by side and on their way out. Every sink plays a stage.

A place holds one engine. Engines of different scenes are of different types: with each comes the address of the
function that was compiled for it. Who may change a place's state is known from the state itself, so nobody waits:

    EMPTY -> PLAYING     the control thread, when the place is filled
    PLAYING -> LEAVING   the control thread; the audio thread then fades the drum out, without a click
    LEAVING -> GONE      the audio thread, which does not touch the place again
    GONE -> EMPTY        the control thread, which lets go of the engine

`mix` and what it calls: audio thread, no allocation, no locks. `Stage`: any number of control threads.
"""

import functools
import math
import threading
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import types
from numba.np.numpy_support import carray

from drumstick.drum.block import render_block
from drumstick.drum.engine import Engine
from drumstick.drum.output.limiter import limit
from realtime.atomics import load_acquire, peek, poke, store_release
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.foreign import call_block
from realtime.kernels.handover import ForeignHandle, take_up_typed, typed_callback
from realtime.kernels.jit import CFunction, njit
from realtime.records import Record, Rows, dtype_of

PLACES = 16
EMPTY, PLAYING, LEAVING, GONE = 0, 1, 2, 3
_MAX_FRAMES = 1024  # rendered at once; longer blocks come in parts
_FADE_S = 0.06
_array: Any = carray  # numba knows it by value; its own annotations do not fit addresses


class MixerSlot(Record):
    """`gone` is how far the fade has come, 0..1; it begins after `hold` frames and advances by `fall` a frame."""

    function: int
    argument: int
    hold: int
    gone: float
    fall: float


PLACE = dtype_of(MixerSlot)


class MixBuffers(NamedTuple):
    """Arrays of the audio thread. Shapes: states, places and begun (16,), one and sum (1024, 2). begun: the pulses that
    each drum was given so far."""

    states: npt.NDArray[np.int64]
    places: Rows[MixerSlot]
    one: npt.NDArray[np.float32]
    sum: npt.NDArray[np.float32]
    begun: npt.NDArray[np.int64]


class StageFull(Exception):
    """Every place is taken: 16 drums sound already."""


@njit()
def _add(boards: MixBuffers, at: int, frames: int, leaving: bool) -> None:
    place: MixerSlot = boards.places[at]
    if not leaving:
        for i in range(frames):
            boards.sum[i, 0] += boards.one[i, 0]
            boards.sum[i, 1] += boards.one[i, 1]
        return
    for i in range(frames):
        if place.hold > 0:
            place.hold -= 1
        else:
            place.gone = min(1.0, place.gone + place.fall)
        level = np.float32(0.5 + 0.5 * math.cos(math.pi * place.gone))
        boards.sum[i, 0] += level * boards.one[i, 0]
        boards.sum[i, 1] += level * boards.one[i, 1]
    if place.gone >= 1.0:
        store_release(boards.states, at, GONE)


@njit()
def mix(boards: MixBuffers, out: npt.NDArray[np.float32], rate_Hz: float, start_ns: int) -> None:
    """Fill `out`, shape (frames, 1 or 2), with everything that sounds from `start_ns` (monotonic) on, limited.

    The caller sets the float mode.
    """
    first = 0
    while first < out.shape[0]:
        frames = min(out.shape[0] - first, _MAX_FRAMES)
        boards.sum[:frames] = np.float32(0.0)
        for at in range(PLACES):
            state = load_acquire(boards.states, at)
            if state in (PLAYING, LEAVING):
                place: MixerSlot = boards.places[at]
                since_ns = int(first * 1e9 / rate_Hz)
                call_block(
                    place.function, place.argument, boards.one.ctypes.data, frames, start_ns + since_ns
                )
                _add(boards, at, frames, state == LEAVING)
        for i in range(frames):
            if out.shape[1] == 1:
                out[first + i, 0] = np.float32(0.5) * (boards.sum[i, 0] + boards.sum[i, 1])
            else:
                out[first + i, 0] = boards.sum[i, 0]
                out[first + i, 1] = boards.sum[i, 1]
        first += frames
    limit(out)


def _play(argument: Any, output: Any, frames: int, start_ns: int) -> None:
    # No closure over the kind: that would be compiled anew in each process, for longer than all else takes.
    taken, begun = take_up_typed(argument)
    out: npt.NDArray[np.float32] = _array(output, (frames, 2), np.float32)
    render_block(borrowed_view(taken), out, start_ns)
    begun[0] = taken.meters[0].begun


@functools.cache
def _player_of(kind: Any) -> CFunction:
    return CFunction(_play, typed_callback(kind, types.voidptr, types.int64, types.int64))


class Mixer:
    """Up to 16 drums. It must live as long as any audio thread that plays `boards`."""

    def __init__(self, rate_Hz: int) -> None:
        self._rate_Hz = rate_Hz
        self.boards = MixBuffers(
            np.zeros(PLACES, np.int64),
            np.zeros(PLACES, PLACE),
            np.zeros((_MAX_FRAMES, 2), np.float32),
            np.zeros((_MAX_FRAMES, 2), np.float32),
            np.zeros(PLACES, np.int64),
        )
        self._held: dict[int, tuple[ForeignHandle, CFunction]] = {}
        self._filling = threading.Lock()

    def enter(self, engine: Engine) -> int:
        """Let `engine` sound from the next block on; returns its place. Seconds where its kernels must compile."""
        with self._filling:
            self._clear()
            for at in range(PLACES):
                if at not in self._held:
                    handed = ForeignHandle((engine, self.boards.begun[at : at + 1]))
                    function = _player_of(handed.kind)
                    self._held[at] = handed, function
                    self.boards.places[at] = (function.address, handed.address, 0, 0.0, 0.0)
                    poke(self.boards.states, at, PLAYING)
                    return at
        raise StageFull(f"{PLACES} drums sound already: stop one, or wait until one has faded")

    def leave(self, at: int, after_s: float = 0.0) -> None:
        """Fade the drum at this place out in 60 ms, beginning `after_s` from now; another may enter there then."""
        place: MixerSlot = self.boards.places[at]
        place["hold"] = round(after_s * self._rate_Hz)
        place["fall"] = 1.0 / (_FADE_S * self._rate_Hz)
        poke(self.boards.states, at, LEAVING)

    def has_left(self, at: int) -> bool:
        """True when the drum that left this place has faded; then nothing of it is held here any more."""
        with self._filling:
            self._clear()
            return at not in self._held

    def _clear(self) -> None:
        # Let go of the drums that have faded.
        for at in list(self._held):
            if peek(self.boards.states, at) == GONE:
                del self._held[at]
                poke(self.boards.states, at, EMPTY)

    @property
    def drums(self) -> int:
        """Number of places taken, those of fading drums included."""
        return len(self._held)
