"""Mixer of all sounding drums, side by side and on their way out. Every sink plays one.

A slot holds one engine, and the channels by which each of its pairs leaves. Engines of different scenes are of
different types: with each comes the address of the function that was compiled for it. Who may change a slot's state is
known from the state itself, so nobody waits:

    EMPTY -> PLAYING     the control thread, when the slot is filled
    PLAYING -> LEAVING   the control thread; the audio thread then fades the drum out, without a click
    LEAVING -> GONE      the audio thread, which does not touch the slot again
    GONE -> EMPTY        the control thread, which lets go of the engine

A drum with an effect that hears others (`drumstick.drum.engine.hears_others`) is rendered after those without one, and
hears the sum of them: what it plays itself goes to no other, so there is no loop.

`mix` and what it calls: audio thread, no allocation, no locks. `Mixer`: any number of control threads.
"""

import functools
import math
import threading
from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import types
from numba.np.numpy_support import carray

from drumstick.drum.block import render_block
from drumstick.drum.engine import OUTSIDE_FRAMES, Engine, hearing, hears_others
from drumstick.drum.output.fade import CHOKE_S, FADE_S
from drumstick.drum.output.limiter import limited
from drumstick.drum.output.output_meter import OUTPUT_METER, OutputMeter, limit_and_measure
from drumstick.drum.output.stems import width
from realtime.atomics import load_acquire, peek, poke, store_release
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.foreign import call_block
from realtime.kernels.handover import ForeignHandle, take_up_typed, typed_callback
from realtime.kernels.jit import CFunction, njit
from realtime.records import Record, Rows, dtype_of, is_there
from sound_server.second_thread import SecondThread, make_ready, second_thread

SLOTS = 16
EMPTY, PLAYING, LEAVING, GONE = 0, 1, 2, 3
_MAX_FRAMES = OUTSIDE_FRAMES  # rendered at once; longer blocks come in parts
_MAX_WIDTH = 2 + 2 * 16  # channels of one drum: its mix, and each of the pickups that a scene may have
_STEREO = ((0, 1),)
_array: Any = carray  # numba knows it by value; its own annotations do not fit addresses


class MixerSlot(Record):
    """`fade` is how far the fade-out has come, 0..1; it begins after `hold` frames, of which `waited` are over, and
    comes `fade_step` further each frame. A choke shortens the hold of a drum that is leaving already. hears: 1 for a
    drum that hears the others. `width`: channels of the drum; `channels`: those of the device, from 0, by which they
    leave."""

    function: int
    argument: int
    hears: int
    hold: int  # this and fade_step: the control thread
    fade_step: float
    waited: int  # this and fade: the audio thread
    fade: float
    width: int
    channels: Annotated[npt.NDArray[np.int64], "i8", (_MAX_WIDTH,)]


MIXER_SLOT = dtype_of(MixerSlot)


class MixBuffers(NamedTuple):
    """Arrays of the audio thread. Shapes: states, slots and begun (16,), voice (1024 * 34,), bus (1024, channels of the
    device, at least 2), outside (1024,), meter (1,), mean_squares as many as the bus has channels. voice: one drum's
    sound; bus: the sum of all; begun: the pulses that each drum was given so far; outside: what drums hear that hear
    others, in one channel and limited; meter: of what leaves; mean_squares: its memory."""

    states: npt.NDArray[np.int64]
    slots: Rows[MixerSlot]
    voice: npt.NDArray[np.float32]
    bus: npt.NDArray[np.float32]
    begun: npt.NDArray[np.int64]
    outside: npt.NDArray[np.float32]
    meter: Rows[OutputMeter]
    mean_squares: npt.NDArray[np.float64]


class MixerFull(Exception):
    """Every slot is taken: 16 drums sound already."""


class _Held(NamedTuple):
    # What the audio thread uses of a slot, and must outlive that.
    engine: Engine
    handed: ForeignHandle
    function: CFunction
    pairs: Sequence[tuple[int, int]]


@njit()
def _add(buffers: MixBuffers, at: int, frames: int, leaving: bool) -> None:
    slot: MixerSlot = buffers.slots[at]
    width = slot.width
    if not leaving:
        for i in range(frames):
            for k in range(width):
                buffers.bus[i, slot.channels[k]] += buffers.voice[i * width + k]
        return
    for i in range(frames):
        if slot.waited < slot.hold:
            slot.waited += 1
        else:
            slot.fade = min(1.0, slot.fade + slot.fade_step)
        level = np.float32(0.5 + 0.5 * math.cos(math.pi * slot.fade))
        for k in range(width):
            buffers.bus[i, slot.channels[k]] += level * buffers.voice[i * width + k]
    if slot.fade >= 1.0:
        store_release(buffers.states, at, GONE)


@njit()
def _play_all(buffers: MixBuffers, frames: int, at_ns: int, hears: int) -> int:
    # Add all drums that hear others, or all that do not; how many sounding ones were left out.
    others = 0
    for at in range(SLOTS):
        state = load_acquire(buffers.states, at)
        if state in (PLAYING, LEAVING):
            slot: MixerSlot = buffers.slots[at]
            if slot.hears != hears:
                others += 1
                continue
            call_block(slot.function, slot.argument, buffers.voice.ctypes.data, frames, at_ns)
            _add(buffers, at, frames, state == LEAVING)
    return others


@njit()
def mix(buffers: MixBuffers, out: npt.NDArray[np.float32], rate_Hz: float, start_ns: int) -> None:
    """Fill `out`, shape (frames, channels of the bus, or 1), with everything that sounds from `start_ns` (monotonic).

    Limited and metered. The caller sets the float mode.
    """
    first = 0
    while first < out.shape[0]:
        frames = min(out.shape[0] - first, _MAX_FRAMES)
        buffers.bus[:frames] = np.float32(0.0)
        at_ns = start_ns + int(first * 1e9 / rate_Hz)
        left_out = _play_all(buffers, frames, at_ns, 0)
        if left_out > 0:
            for i in range(frames):
                both = 0.0  # whatever pairs of the device it leaves by
                for channel in range(buffers.bus.shape[1]):
                    both += float(buffers.bus[i, channel])
                buffers.outside[i] = np.float32(limited(0.5 * both))
            _play_all(buffers, frames, at_ns, 1)
        for i in range(frames):
            if out.shape[1] == 1:
                out[first + i, 0] = np.float32(0.5) * (buffers.bus[i, 0] + buffers.bus[i, 1])
            else:
                for channel in range(out.shape[1]):
                    out[first + i, channel] = buffers.bus[i, channel]
        first += frames
    limit_and_measure(out, buffers.meter, buffers.mean_squares, rate_Hz)


def _play(argument: Any, output: Any, frames: int, start_ns: int) -> None:
    # No closure over the kind: that would be compiled anew in each process, for longer than all else takes.
    taken, begun = take_up_typed(argument)
    engine = borrowed_view(taken)
    out: npt.NDArray[np.float32] = _array(output, (frames, width(engine)), np.float32)
    render_block(engine, out, start_ns)
    begun[0] = taken.meters[0].begun


@functools.cache
def _player_of(kind: Any) -> CFunction:
    return CFunction(_play, typed_callback(kind, types.voidptr, types.int64, types.int64))


class Mixer:
    """Up to 16 drums, for a device of so many channels. It must live as long as any audio thread that plays
    `buffers`."""

    def __init__(self, rate_Hz: int, channels: int = 2) -> None:
        self._rate_Hz = rate_Hz
        self.buffers = MixBuffers(
            np.zeros(SLOTS, np.int64),
            np.zeros(SLOTS, MIXER_SLOT),
            np.zeros(_MAX_FRAMES * _MAX_WIDTH, np.float32),
            np.zeros((_MAX_FRAMES, max(channels, 2)), np.float32),
            np.zeros(SLOTS, np.int64),
            np.zeros(OUTSIDE_FRAMES, np.float32),
            np.zeros(1, OUTPUT_METER),
            np.zeros(max(channels, 2)),
        )
        self._held: dict[int, _Held] = {}
        self._seconds: dict[int, SecondThread] = {}
        self._filling = threading.Lock()

    def enter(self, engine: Engine, pairs: Sequence[tuple[int, int]] = _STEREO) -> int:
        """Let `engine` sound from the next block on; returns its slot. Seconds where its kernels must compile.

        pairs: the device's channels, from 0, for its mix and each of its stems.
        """
        stems = len(engine.stems.now) // 2 if is_there(engine.stems) else 0
        if len(pairs) != 1 + stems or max(map(max, pairs)) >= self.buffers.bus.shape[1]:
            raise ValueError(f"pairs {pairs} do not fit a drum with {stems} stems, or the device")
        with self._filling:
            return self._enter(engine, pairs)

    def _enter(self, engine: Engine, pairs: Sequence[tuple[int, int]], like: _Held | None = None) -> int:
        heard = int(hears_others(engine))
        given = hearing(engine, self.buffers.outside)
        self._clear()
        for at in range(SLOTS):
            if at not in self._held:
                handed = ForeignHandle(
                    (given, self.buffers.begun[at : at + 1]), None if like is None else like.handed
                )
                function = _player_of(handed.kind)
                self._held[at] = _Held(engine, handed, function, pairs)
                channels = np.zeros(_MAX_WIDTH, np.int64)
                channels[: 2 * len(pairs)] = np.ravel(pairs)
                self.buffers.slots[at] = (
                    function.address, handed.address, heard, 0, 0.0, 0, 0.0, 2 * len(pairs), channels
                )  # fmt: skip
                poke(self.buffers.states, at, PLAYING)
                second = second_thread(given)
                if second is not None:
                    self._seconds[at] = second
                return at
        raise MixerFull(f"{SLOTS} drums sound already: stop one, or wait until one has faded")

    def choke(self, at: int, after_s: float, rested: Engine) -> int:
        """Fade the drum in this slot out in 30 ms, beginning `after_s` from now, and let `rested`, a copy of it at
        rest, sound from the next block on; returns its slot. Raises MixerFull; then nothing has changed."""
        with self._filling:
            held = self._held[at]
            entered = self._enter(rested, held.pairs, held)
            self._leave(at, after_s, CHOKE_S)
        return entered

    def hasten(self, engine: Engine, after_s: float) -> None:
        """Fade this drum, which is leaving, out in 30 ms, beginning `after_s` from now, if not before that."""
        with self._filling:
            for at, held in self._held.items():
                if held.engine is engine:
                    slot: MixerSlot = self.buffers.slots[at]
                    sooner = int(slot["waited"]) + round(after_s * self._rate_Hz)
                    if sooner < slot["hold"]:
                        slot["hold"] = sooner
                        slot["fade_step"] = 1.0 / (CHOKE_S * self._rate_Hz)

    def holds(self, engine: Engine) -> bool:
        """True if this drum is in a slot, be it that it fades."""
        with self._filling:
            self._clear()
            return any(held.engine is engine for held in self._held.values())

    def make_ready(self, engine: Engine) -> None:
        """Compile or load what `enter` needs for engines of this type. Seconds."""
        _player_of(ForeignHandle((engine, self.buffers.begun[:1])).kind)
        make_ready(engine)

    def close(self) -> None:
        """End the second threads of drums that have one. The audio thread, which may play on, does without them."""
        with self._filling:
            for second in self._seconds.values():
                second.end()

    def leave(self, at: int, after_s: float = 0.0) -> None:
        """Fade the drum in this slot out in 60 ms, beginning `after_s` from now; another may enter there then."""
        self._leave(at, after_s, FADE_S)

    def _leave(self, at: int, after_s: float, fade_s: float) -> None:
        slot: MixerSlot = self.buffers.slots[at]
        slot["hold"] = round(after_s * self._rate_Hz)
        slot["fade_step"] = 1.0 / (fade_s * self._rate_Hz)
        poke(self.buffers.states, at, LEAVING)

    def has_left(self, at: int) -> bool:
        """True when the drum that left this slot has faded; then nothing of it is held here any more."""
        with self._filling:
            self._clear()
            return at not in self._held

    def let_go(self) -> None:
        """Let go of the drums that have faded."""
        with self._filling:
            self._clear()

    def _clear(self) -> None:
        for at in list(self._held):
            if peek(self.buffers.states, at) == GONE:
                del self._held[at]
                if at in self._seconds:
                    self._seconds.pop(at).end()
                poke(self.buffers.states, at, EMPTY)

    @property
    def drums(self) -> int:
        """Number of slots taken, those of fading drums included."""
        return len(self._held)
