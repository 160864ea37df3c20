"""The memory of a streamed force: pieces on their way to the audio thread, and the timeline that it plays from.

The timeline holds one cell for each of the servo's newest ticks, as many as `stream_of` lays out. All contacts lie on
it: what two of them give in one tick adds up, so flams and buzzes need no voices of their own.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from realtime import ring
from realtime.records import Record, Records, Rows, dtype_of

RING_SLOTS = 256
PIECE_MOST = 32  # samples in a piece; a longer message becomes several
_INCOMING = 128
_MIN_CELLS = 16384  # a third of a second of what a message may bring at most, 48 kHz
_AHEAD_S = 0.25  # beyond the scene's latency


class Piece(Record):
    """A run of samples whose first begins at start_ns of this machine's clock. Another epoch is another servo."""

    epoch: int
    first: int
    count: int
    start_ns: int
    period_ns: float
    x: float
    y: float
    forces: Annotated[npt.NDArray[np.float32], "f4", (PIECE_MOST,)]


PIECE = dtype_of(Piece)


class Cell(Record):
    """The mean force of one tick, N, and where it acts, in radii."""

    tick: int
    force: float
    x: float
    y: float


CELL = dtype_of(Cell)


class StreamState(Record):
    """Position of the playing stream: `inside` (0..1) of cell `tick`, whose force is a parabola with the mean `mean`
    from `left` to `right`; `before` was the mean before it; cells up to `entered` take no more samples, those before
    `begin` are silent. `newest` is the last tick that came, `held` the last force, `gap` for how many ticks it has
    been held or faded.
    """

    epoch: int
    idle: int
    begin: int
    tick: int
    entered: int
    inside: float
    ticks_per_step: float
    period_ns: float
    left: float
    mean: float
    right: float
    before: float
    newest: int
    held: float
    gap: int
    x: float
    y: float
    step_ns: float
    next_step_ns: int  # when the next step of the mesh begins
    block_ns: int  # how long the audio thread's blocks are
    underflows: int
    late: int  # samples that came after their time
    resyncs: int


STATE = dtype_of(StreamState)


class Stream(NamedTuple):
    """state (1,) of STATE, cells (n,) of CELL, incoming (128,) of PIECE; ring_cells int64 (24,), ring_slots (256,)."""

    state: Rows[StreamState]
    cells: Rows[Cell]
    incoming: Rows[Piece]
    ring_cells: npt.NDArray[np.int64]
    ring_slots: Rows[Piece]


def stream_of(scene: Scene, step_s: float) -> Stream:
    """An empty timeline for a mesh that steps every step_s. Allocates."""
    ticks = (scene.drum.latency_s + _AHEAD_S) * scene.servo.rate_Hz
    cells: Records = np.zeros(max(_MIN_CELLS, 2 ** math.ceil(math.log2(ticks))), CELL)
    cells["tick"] = -1
    state: Records = np.zeros(1, STATE)
    state["idle"], state["step_ns"] = 1, step_s * 1e9
    incoming: Records = np.zeros(_INCOMING, PIECE)
    slots: Records = np.zeros(RING_SLOTS, PIECE)
    return Stream(state, cells, incoming, ring.new_cells(), slots)
