"""`internal_loss`: the head's own material takes more from high modes than from low ones (Kelvin-Voigt).

The junctions' momentum p is kept besides their height: p' = rho p + a, u+ = u + p' + eta a, where a is the pull of the
neighbours. Which rho and eta: membrane.scheme.rising_losses. Kernels: audio thread.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.heads import aligned
from drumstick.parameters.declare import number
from drumstick.parameters.drum import Drum
from realtime.kernels.jit import only_with
from realtime.records import ABSENT, is_there

if TYPE_CHECKING:
    from drumstick.drum.effects.building import Building
    from drumstick.drum.engine import Engine


@dataclass(frozen=True)
class InternalLossTable:
    """The head's material takes more from high modes: a dull head rather than a bright one."""

    t60_s: float = number(0.15, 0.001, 60.0, "s", "Time in which a mode at at_Hz falls by 60 dB")
    at_Hz: float = number(
        2000.0, 50.0, 20000.0, "Hz", "Frequency at which t60_s holds; below it the loss falls with f^2"
    )


TABLE = InternalLossTable
ON_MODES = True


def rising_loss(table: InternalLossTable) -> tuple[float, float]:
    """The time in which a mode at so many Hz falls by 60 dB."""
    return table.t60_s, table.at_Hz


def mistakes(table: InternalLossTable, drum: Drum) -> Iterator[tuple[str, str]]:
    """A loss that would fall with the frequency."""
    if not (table.t60_s < drum.t60_s and table.at_Hz > drum.f01_Hz):
        yield (
            "",
            f"t60_s = {table.t60_s:g} s at {table.at_Hz:g} Hz must be shorter and higher than the drum's own, "
            f"{drum.t60_s:g} s at {drum.f01_Hz:g} Hz",
        )


class Momentum(NamedTuple):
    """p, shape (J,), and (rho, eta), shape (2,)."""

    moving: npt.NDArray[np.float32]
    gains: npt.NDArray[np.float32]


def part_of(building: "Building") -> Momentum:
    """Memory at rest; None where losses are in the coefficients: on modes, or if they hardly rise."""
    if not (is_there(building.numbers) and building.numbers.with_momentum):
        return ABSENT
    losses = building.numbers.losses
    moving = aligned((building.lattice.weights.size,))
    return Momentum(moving, np.array([losses.rho, losses.eta], np.float32))


@only_with("internal_loss")
def momentum(engine: "Engine") -> Any:
    """p, or None without this effect."""
    return engine.effects.internal_loss.moving


@only_with("internal_loss")
def rho(engine: "Engine") -> Any:
    """rho, or None."""
    return engine.effects.internal_loss.gains[0]


@only_with("internal_loss")
def eta(engine: "Engine") -> Any:
    """eta, or None."""
    return engine.effects.internal_loss.gains[1]


@only_with("internal_loss")
def pushed(engine: "Engine", junction: int, step: float) -> None:
    """Let a junction that a force has moved by so much in a step go on moving."""
    loss: Momentum = engine.effects.internal_loss
    loss.moving[junction] += np.float32(step)


@only_with("internal_loss")
def reset(engine: "Engine") -> None:
    """All at rest."""
    loss: Momentum = engine.effects.internal_loss
    loss.moving[:] = np.float32(0.0)
