"""Sweep of one or two parameters: rolls, buzzes, rests in the head, or flies away.

    for swept in sweep(scene, [Axis("dv_pls", np.linspace(0.05, 2.0, 100)), Axis("k_hand", ...)]):
        show(swept.done / swept.total)
    swept.kind      # int8, shape (100, n): STABLE, BUZZING, CAPTURED, LEFT
    swept.v_e_m_per_s   # shape (100, n, 64): v_E of the last contacts, NaN where there are none

Each point is a stick thrown from z = 0 at the scene's `[hand] throw_m_per_s`; `settle` contacts pass, then MEASURED
more are looked at. Axis names are wire names, z_h0 included. Control threads only, one sweep at a time; blocks between
yields for as long as `chunk` points take on all cores.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.settling import MAX_PERIOD
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import table_of, with_changes
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from realtime.kernels.jit import njit, prange
from realtime.records import Records

# What becomes of the stick. BUZZING: no settled period, a period of more than one contact, or contacts that follow one
# another faster than BUZZ_HZ. LEFT: it never comes back, or its speed grows without end.
STABLE, BUZZING, CAPTURED, LEFT = 0, 1, 2, 3
KINDS = ("stable roll", "buzzing", "rests in the head", "leaves")

# Contacts less than 10 ms apart are heard as a tone, not as strokes. A convention: nothing in the motion changes there.
BUZZ_HZ = 100.0
MEASURED = 64
SAME = 1e-6  # two speeds that differ by less than this share are the same
_MAX_EFFORT = 100_000.0  # of one point (return_step.EFFORT): it would take a second


@dataclass(frozen=True)
class Axis:
    """One swept parameter: its wire name and the values, shape (n,)."""

    name: str
    values: npt.NDArray[np.float64]


@dataclass(frozen=True)
class Swept:
    """A sweep, filled as far as `done` of `total` points. Arrays have the shape of the axes, in their order.

    kind: int8. v_e_m_per_s: + (MEASURED,). rate_Hz: contacts a second, NaN without a roll. period: contacts until the
    motion repeats, 1 .. MAX_PERIOD, 0 when it does not.
    """

    axes: tuple[Axis, ...]
    kind: npt.NDArray[np.int8]
    v_e_m_per_s: npt.NDArray[np.float64]
    rate_Hz: npt.NDArray[np.float64]
    period: npt.NDArray[np.int64]
    done: int
    total: int


@njit()
def period_of(v_e: npt.NDArray[np.float64]) -> int:
    """Number of contacts after which these speeds, shape (n,), repeat; 0 when not within MAX_PERIOD."""
    for period in range(1, MAX_PERIOD + 1):
        same = True
        for i in range(period, v_e.shape[0]):
            if not abs(v_e[i] - v_e[i - period]) <= SAME * abs(v_e[i]):
                same = False
                break
        if same:
            return period
    return 0


@njit()
def _point(
    laws: Records, motions: Records, i: int, settle: int, v_e: npt.NDArray[np.float64]
) -> tuple[int, float, int]:
    # Plays point i; returns kind, rate, period.
    measured = np.zeros(return_step.MEASURED_SIZE)
    seconds = 0.0
    for contact in range(settle + MEASURED):
        outcome = return_step.next_release(laws[i], motions[i], return_step.FEW_WAIT_DOUBLINGS, measured)
        if outcome == exact.LEFT:
            v_e[:] = np.nan
            return LEFT, np.nan, 0
        if outcome != exact.MOVING:  # held down for thousands of oscillations is rest in the head, too
            v_e[:] = np.nan
            return CAPTURED, np.nan, 0
        if (
            measured[return_step.EFFORT] > _MAX_EFFORT
        ):  # it rings in the head for ever between rare contacts: no roll either
            return BUZZING, np.nan, 0
        if contact >= settle:
            v_e[contact - settle] = measured[return_step.V_E]
            seconds += measured[return_step.PERIOD_S]
    rate = MEASURED / seconds
    period = period_of(v_e)
    return (STABLE if period == 1 and rate < BUZZ_HZ else BUZZING), rate, period


@njit(parallel=True)
def _points(
    laws: Records,
    motions: Records,
    settle: int,
    kind: npt.NDArray[np.int8],
    v_e: npt.NDArray[np.float64],
    rate: npt.NDArray[np.float64],
    period: npt.NDArray[np.int64],
) -> None:
    for i in prange(laws.shape[0]):
        kind[i], rate[i], period[i] = _point(laws, motions, i, settle, v_e[i])


def laws_over(scene: Scene, axes: Sequence[Axis]) -> Records:
    """The law at every point of the grid, in C order, shape (points,). Raises Refusal for a value out of range."""
    law, table = law_of(scene), table_of(scene)
    names = [axis.name for axis in axes]
    grid = np.stack(np.meshgrid(*(axis.values for axis in axes), indexing="ij"), axis=-1)
    points = grid.reshape(-1, len(names))
    laws = np.zeros(len(points), law.dtype)
    for i, values in enumerate(points):
        changes = dict(zip(names, map(float, values), strict=True))
        laws[i] = with_changes(law, table, changes)[0]
    return laws


def sweep(scene: Scene, axes: Sequence[Axis], settle: int = 400, chunk: int = 64) -> Iterator[Swept]:
    """Play every point of the grid; yields after every `chunk` points, the last time with all of them.

    Raises Refusal when a value is outside its parameter's range or the scene has no such parameter.
    """
    laws = laws_over(scene, axes)
    total = len(laws)
    motions = np.repeat(thrown(scene, scene.hand.throw_m_per_s), total)
    kind = np.zeros(total, np.int8)
    v_e, rate = np.full((total, MEASURED), np.nan), np.full(total, np.nan)
    period = np.zeros(total, np.int64)
    shape = tuple(len(axis.values) for axis in axes)
    for start in range(0, total, chunk):
        part = slice(start, min(start + chunk, total))
        _points(laws[part], motions[part], settle, kind[part], v_e[part], rate[part], period[part])
        yield Swept(
            tuple(axes),
            kind.reshape(shape),
            v_e.reshape(*shape, MEASURED),
            rate.reshape(shape),
            period.reshape(shape),
            part.stop,
            total,
        )
