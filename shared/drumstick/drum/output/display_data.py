"""Display data of a drum while somebody looks: its surface 30 times a second, and its latest sound.

The audio thread leaves copies, the network's thread takes them; neither waits for the other. While nobody looks the
audio thread reads one cell a block for each, and copies nothing.
"""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drumstick.drum.memory.display import PACE, DisplayBuffers, DisplayRate
from realtime import triple_buffer
from realtime.atomics import load_acquire, peek, poke, store_release
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

FRAMES_PER_S = 30
SOUND_SAMPLES = (
    1 << 15
)  # samples kept: a reader of half of them has as long as they last before they are written over
_SURFACE, _SOUND, _WRITTEN = 0, 8, 16  # cells, each on a cache line of its own


def display_buffers(places: npt.NDArray[np.int64], shares: npt.NDArray[np.float32]) -> DisplayBuffers:
    """Display data with nothing requested yet. Any thread; allocates."""
    cells = np.zeros(triple_buffer.CELLS, np.int64)
    slots = np.zeros((3, len(places)), np.float32)
    cells[triple_buffer.READER], cells[triple_buffer.BETWEEN] = 2, 1
    heard = np.zeros(SOUND_SAMPLES, np.float32)
    return DisplayBuffers(np.zeros(24, np.int64), cells, slots, places, shares, heard, np.zeros(1, PACE))


@njit()
def _gather(shown: DisplayBuffers, held: npt.NDArray[np.float32]) -> None:
    out = shown.slots[shown.cells[triple_buffer.WRITER]]
    for i in range(out.shape[0]):
        total = np.float32(0.0)
        for k in range(shown.places.shape[1]):
            total += shown.shares[i, k] * held[shown.places[i, k]]
        out[i] = total


@only_with("head")
def _copy_mesh(engine: "Engine") -> None:
    _gather(engine.shown, engine.head.time_levels[engine.control[0].present_level])


@only_with("modal")
def _copy_modes(engine: "Engine") -> None:
    _gather(engine.shown, engine.modal.q)


@njit()
def show_surface(engine: "Engine", frames: int) -> None:
    """Copy the surface when somebody looks and it is time; a head at rest once. Audio thread, once a block."""
    shown: DisplayBuffers = engine.shown
    if load_acquire(shown.requested, _SURFACE) == 0:
        return
    pace: DisplayRate = shown.pace[0]
    pace.due -= frames
    asleep = engine.control[0].asleep
    if pace.due > 0 or (asleep != 0 and pace.rested != 0):
        return
    pace.due = max(pace.due + int(engine.control[0].rate_Hz / FRAMES_PER_S), 0)
    pace.rested = asleep
    _copy_mesh(engine)
    _copy_modes(engine)
    triple_buffer.offer(shown.cells)


@njit()
def show_sound(engine: "Engine", out: npt.NDArray[np.float32]) -> None:
    """Keep a block, all its channels mixed, when somebody looks. Audio thread."""
    shown: DisplayBuffers = engine.shown
    if load_acquire(shown.requested, _SOUND) == 0:
        return
    written = load_acquire(shown.requested, _WRITTEN)
    for i in range(out.shape[0]):
        total = np.float32(0.0)
        for channel in range(out.shape[1]):
            total += out[i, channel]
        shown.heard[(written + i) % SOUND_SAMPLES] = np.float32(0.5) * total
    store_release(shown.requested, _WRITTEN, written + out.shape[0])


def request_display(shown: DisplayBuffers, surface: bool, sound: bool) -> None:
    """Say what is looked at. One thread."""
    if surface and not peek(shown.requested, _SURFACE):
        shown.pace["rested"] = 0  # nobody has seen it yet; the audio thread does not look at it now
    poke(shown.requested, _SURFACE, int(surface))
    poke(shown.requested, _SOUND, int(sound))


def take_surface(shown: DisplayBuffers) -> npt.NDArray[np.float32] | None:
    """The newest surface, shape (N,), good until the next call; None when it was taken already. One reader."""
    if not triple_buffer.has_fresh(shown.cells):
        return None
    return shown.slots[triple_buffer.take(shown.cells)]


def last_heard(shown: DisplayBuffers, samples: int) -> npt.NDArray[np.float32]:
    """A copy of the newest samples, at most 16384, oldest first. Any thread."""
    end = peek(shown.requested, _WRITTEN)
    return shown.heard[(end - samples + np.arange(samples)) % SOUND_SAMPLES]
