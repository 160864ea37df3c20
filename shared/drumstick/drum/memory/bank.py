"""A bank of modes, and the steps that it takes at once."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.memory.pulses import POOL
from realtime.records import ABSENT, Record, Rows, dtype_of

Floats = npt.NDArray[np.float32]
TILE = 64  # oscillators that a block steps together: see drumstick.drum.modal.blocks
STEPS = 256  # most steps of a block
MAX_LANES = 16
CELL = 16  # steps: see drumstick.drum.modal.apart
PRESS_STEPS = 256  # 5 ms at 48 kHz: see drumstick.drum.modal.held


class HeldModes(NamedTuple):
    """Modes that something on the head damps as hard as it is pressed. Shapes (N,) unless said: share, what it adds at
    press 1 to a mode's loss s, over 1 + s; r_squared, stiffness, and masses and tension_stiffness where the bank has
    them, as they are at press 0; drive_scale, what a force's movement counts for now; turn (2, P), cosine and sine by
    which each pair is turned so that the two are damped apart."""

    share: Floats
    r_squared: Floats
    stiffness: Floats
    drive_scale: Floats
    turn: Floats
    masses: Floats = ABSENT
    tension_stiffness: Floats = ABSENT


class Bank(NamedTuple):
    """Shapes, with P radial modes and N oscillators, 2 P and as many at rest as fill the last tile: q, d, r_squared
    (R^2), stiffness (k), left and right (N,); orders (P,); radial (K, P): J_m(j r) times what a force of 1 N drives, at
    the radii r = (row - 1) / (K - 3); strike_weights (32, N), a row for each pulse of the pool, or mallet; angular (2,
    orders): cos and sin of m phi.

    What not every scene has, (N,): masses, for mallets: over what a force of 1 N drives; left_by_displacement and
    right_by_displacement, for microphones: gains of q, where left and right are those of d; stretch_weights (l) and
    tension_stiffness (r k/R^2), for tension: see drumstick.drum.modal.stretch. held, for what lies on the head.
    """

    q: Floats
    d: Floats
    r_squared: Floats
    stiffness: Floats
    left: Floats
    right: Floats
    orders: npt.NDArray[np.int64]
    radial: Floats
    strike_weights: Floats
    angular: npt.NDArray[np.float64]
    masses: Floats = ABSENT
    left_by_displacement: Floats = ABSENT
    right_by_displacement: Floats = ABSENT
    stretch_weights: Floats = ABSENT
    tension_stiffness: Floats = ABSENT
    held: HeldModes = ABSENT


class BlockState(Record):
    """Steps of the present block, and how many of them have been handed out.

    Under tension: `lowest`, radial modes that are stepped one by one; `apart`, 1 while the others count by their mean
    stretch; that mean; `energy`, the least of the bank since then; `whole_until`, the step of the drum before which all
    modes go step by step. See drumstick.drum.modal.apart.
    """

    steps: int
    taken: int
    lowest: int
    apart: int
    mean_stretch: float
    energy: float
    whole_until: int


STATE = dtype_of(BlockState)


class Blocks(NamedTuple):
    """state (1,) of STATE; rows (32,), those of `strike_weights` that pulses of this block drive; forces (32, STEPS),
    theirs in each step, N; sums (STEPS, 2, MAX_LANES), on a boundary of 64 bytes: what is heard, lane by lane, left and
    right; heard (STEPS, 2). Under tension: pulls (STEPS,), its own on each step; lowest_heard (STEPS, 2), of the modes
    that are stepped one by one."""

    state: Rows[BlockState]
    rows: npt.NDArray[np.int64]
    forces: Floats
    sums: Floats
    heard: Floats
    pulls: Floats
    lowest_heard: npt.NDArray[np.float64]


def blocks_of(sums: Floats, lowest: int) -> Blocks:
    """No step taken yet. Allocates the rest."""
    state: Rows[BlockState] = np.zeros(1, STATE)
    fields: Record = state[0]
    fields["lowest"] = lowest
    forces, heard = np.zeros((POOL, STEPS), np.float32), np.zeros((STEPS, 2), np.float32)
    pulls, lowest_heard = np.zeros(STEPS, np.float32), np.zeros((STEPS, 2))
    return Blocks(state, np.zeros(POOL, np.int64), forces, sums, heard, pulls, lowest_heard)
