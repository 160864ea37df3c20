"""The memory of a streamed force: pieces on their way to the audio thread, and the timeline that it plays from.

The timeline holds one cell for each tick of the servo, newest SPAN at most. All contacts lie on it: what two of them
give in one tick adds up, so flams and buzzes need no voices of their own.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from realtime import ring
from realtime.kernels.jit import Records

RING_SLOTS = 256
PIECE_MOST = 32  # samples in a piece; a longer message becomes several
_INCOMING = 128
_LEAST_CELLS = 16384  # a third of a second of what a message may bring at most, 48 kHz
_AHEAD_S = 0.25  # beyond the scene's latency

# A run of samples whose first begins at start_ns of this machine's clock. Another epoch is another servo.
PIECE: np.dtype[Any] = np.dtype(
    [
        ("epoch", "i8"),
        ("first", "i8"),
        ("count", "i8"),
        ("start_ns", "i8"),
        ("period_ns", "f8"),
        ("x", "f8"),
        ("y", "f8"),
        ("forces", "f4", (PIECE_MOST,)),
    ],
    align=True,
)
CELL: np.dtype[Any] = np.dtype([("tick", "i8"), ("force", "f8"), ("x", "f8"), ("y", "f8")], align=True)
# Where it plays: `inside` (0..1) of cell `tick`, whose force is a parabola with the mean `mean` from `left` to `right`;
# `before` was the mean before it; cells up to `entered` take no more samples, those before `begin` are silent. `newest`
# is the last tick that came, `held` the last force, `gap` for how many ticks it has been held or faded.
STATE: np.dtype[Any] = np.dtype(
    [
        ("epoch", "i8"),
        ("idle", "i8"),
        ("begin", "i8"),
        ("tick", "i8"),
        ("entered", "i8"),
        ("inside", "f8"),
        ("ticks_per_step", "f8"),
        ("period_ns", "f8"),
        ("left", "f8"),
        ("mean", "f8"),
        ("right", "f8"),
        ("before", "f8"),
        ("newest", "i8"),
        ("held", "f8"),
        ("gap", "i8"),
        ("x", "f8"),
        ("y", "f8"),
        ("step_ns", "f8"),
        ("next_step_ns", "i8"),  # when the next step of the mesh begins
        ("block_ns", "i8"),  # how long the audio thread's blocks are
        ("underflows", "i8"),
        ("late", "i8"),  # samples that came after their time
        ("resyncs", "i8"),
    ],
    align=True,
)


class Stream(NamedTuple):
    """state (1,) of STATE, cells (n,) of CELL, incoming (128,) of PIECE; ring_cells int64 (24,), ring_slots (256,)."""

    state: Records
    cells: Records
    incoming: Records
    ring_cells: npt.NDArray[np.int64]
    ring_slots: Records


def stream_of(scene: Scene, step_s: float) -> Stream:
    """An empty timeline for a mesh that steps every step_s. Allocates."""
    ticks = (scene.drum.latency_s + _AHEAD_S) * scene.servo.rate_Hz
    cells: Records = np.zeros(max(_LEAST_CELLS, 2 ** math.ceil(math.log2(ticks))), CELL)
    cells["tick"] = -1
    state: Records = np.zeros(1, STATE)
    state["idle"], state["step_ns"] = 1, step_s * 1e9
    incoming: Records = np.zeros(_INCOMING, PIECE)
    slots: Records = np.zeros(RING_SLOTS, PIECE)
    return Stream(state, cells, incoming, ring.new_cells(), slots)
