"""Mallets: how each flies, its tip, and what of the head lies under it."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.records import ABSENT, Record, Rows, dtype_of

Floats = npt.NDArray[np.float32]
TIP_LANES = 8
MAX_TIP_ROWS = 36  # as many as a circle of seven spacings' radius meets, two of them beside each other
POOL = 8  # a roll and its flams play two or three; each costs a step of a head with a glide some microseconds


class Tip(Record):
    """Law of a mallet in newtons and metres; `twice_exponent` = 2 p where that is whole, else 0; `energy_factor` =
    1/(p + 1); `loss_rate` = lambda/2T; `compliance`: of mallet and head together, m/N in a step; depth, `energy` V and
    `elastic_force` V' now and a step before; where to look first for the depth to come.
    """

    stiffness: float
    exponent: float
    twice_exponent: int
    energy_factor: float
    loss_rate: float
    compliance: float
    depth: float
    depth_before: float
    energy: float
    energy_before: float
    elastic_force: float
    elastic_force_before: float
    guess: float


TIP = dtype_of(Tip)


class Patches(NamedTuple):
    """Patches of P tips, shapes (P, MAX_TIP_ROWS, 8) unless said: shares g; free, g less what a muffle holds; steps,
    how far a newton moves each junction; starts (P, MAX_TIP_ROWS), the flat index of a row's first lane; rows (P,), how
    many there are."""

    shares: Floats
    free: Floats
    steps: Floats
    starts: npt.NDArray[np.int64]
    rows: npt.NDArray[np.int64]


def patches_of(pool: int) -> Patches:
    """All empty. Allocates."""
    shares, free, steps = np.zeros((3, pool, MAX_TIP_ROWS, TIP_LANES), np.float32)
    return Patches(shares, free, steps, np.zeros((pool, MAX_TIP_ROWS), np.int64), np.zeros(pool, np.int64))


class Shares(NamedTuple):
    """Shares of P tips on M oscillators: still and moving (P, M), what q and d come to under a tip after a step;
    mutual_compliance (P, P), how far a newton at one moves the head under another in a step, in its own unit."""

    still: Floats
    moving: Floats
    mutual_compliance: npt.NDArray[np.float64]


def shares_of(pool: int, modes: int) -> Shares:
    """All empty. Allocates."""
    still, moving = np.zeros((2, pool, modes), np.float32)
    return Shares(still, moving, np.zeros((pool, pool)))


class MalletMotion(Record):
    """`own_compliance`: T^2 over what of its mass the head meets. `age` in steps since the strike; its places `now` and
    `before`; `deepest` so far; the last push; `sum_per_newton`: how much a newton changes the sum of all junctions.
    `free_depth`: how deep the tip would be if nothing pulled and nothing pushed. Under tension, `depth_per_pull`: by
    how much less for a pull of 1; `stretch_per_newton`: what a newton adds to the head's stretch.
    """

    stage: int
    x: float
    y: float
    speed: float
    own_compliance: float
    age: float
    now: float
    before: float
    deepest: float
    force: float
    sum_per_newton: float
    free_depth: float
    depth_per_pull: float
    stretch_per_newton: float


MALLET = dtype_of(MalletMotion)


class MalletsState(Record):
    """radius: of the tip, in radii of the head; own_compliance: T^2/m. Mallets begun so far, and the oldest that may
    still play; how many were taken away by another in their place while they touched, and how many by a full pool.
    Under tension, `last_pull_change`: by how much they changed its pull in the last step. On modes under tension
    (drumstick.drum.mallets.in_touch), -1 for none: `carried`, whose push the coming step has to take with it;
    `foreseen`, of which that step has told, for the next, the head's height under it and what a newton stretches.
    """

    unit_m: float
    step_s: float
    radius: float
    own_compliance: float
    last_pull_change: float
    height_ahead: float
    newton_ahead: float
    carried: int
    foreseen: int
    begun: int
    oldest: int
    lifted: int
    replaced: int


STATE = dtype_of(MalletsState)


class Mallets(NamedTuple):
    """state (1,) of STATE; pool (POOL,) of MALLET, tips (POOL,) of TIP; what of the head lies under them: junctions of
    a mesh, or shares of its modes."""

    state: Rows[MalletsState]
    pool: Rows[MalletMotion]
    tips: Rows[Tip]
    patches: Patches = ABSENT
    shares: Shares = ABSENT
