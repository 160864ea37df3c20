"""Crossfade of pickups that move while the drum plays: where it is, and the gains that it leads from and to."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.records import Record, Records, Rows, dtype_of, is_there

FADE_S = 0.03

# Cells that the two threads hand over by: how often new gains were laid out, written after them by the thread that
# moves the pickups, and to which of them the newest fade has led, by the engine's own when it reads them no more.
OFFERED, DONE = 0, 1
_CELLS = 2


class PickupFadeState(Record):
    """Progress of a fade.

    left: steps that it still has of `steps`, of the engine's own thread; half: which of the two places that each pickup
    has in a mesh is the one that sounds, or will, of the thread that moves the pickups.
    """

    left: int
    steps: int
    half: int


STATE = dtype_of(PickupFadeState)


class PickupFade(NamedTuple):
    """state (1,); cells (2,), by atomic instructions only; ramps: pairs of the gains by which pickups are heard, the
    very arrays that the engine reads, and the gains that they move to; apart: numbers of the pickups that have an
    output pair of their own."""

    state: Rows[PickupFadeState]
    cells: npt.NDArray[np.int64]
    ramps: tuple[tuple[npt.NDArray[Any], npt.NDArray[Any]], ...]
    apart: npt.NDArray[np.int64]


def gains_of(engine: Any) -> tuple[npt.NDArray[Any], ...]:
    """Every array of gains by which this drum's pickups are heard: of its head or its bank, of effects, of stems."""
    found = [engine.pickup_gains]
    found += [part.pickup_gains for part in engine.effects if hasattr(part, "pickup_gains")]
    found += [part.moved.heard for part in engine.effects if hasattr(part, "moved")]
    if is_there(engine.modal):
        found += [engine.modal.left, engine.modal.right]
    if is_there(engine.stems):
        stems = engine.stems
        found += [stems.pickups, stems.second, stems.moved, stems.movement]
    return tuple(found)


def with_fade(engine: Any, apart: Sequence[int] = ()) -> Any:
    """The engine, at rest, with pickups that can be moved; those of the numbers `apart` have pairs of their own."""
    state: Records = np.zeros(1, STATE)
    steps_per_s = float(engine.control["rate_Hz"][0]) / float(engine.control["divisor"][0])
    state["steps"] = max(1, round(FADE_S * steps_per_s))
    cells = np.zeros(_CELLS, np.int64)
    ramps = tuple((gains, gains.copy()) for gains in gains_of(engine) if gains.size)
    return engine._replace(pickup_fade=PickupFade(state, cells, ramps, np.array(apart, np.int64)))
