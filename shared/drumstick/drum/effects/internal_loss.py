"""`internal_loss`: the head's own material takes more from quick modes than from slow ones (Kelvin and Voigt).

The junctions' momentum p is kept besides their height: p' = rho p + a, u+ = u + p' + eta a, where a is the pull of the
neighbours. Which rho and eta: membrane.scheme.rising_losses. Kernels: audio thread.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.kernels.jit import only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine


class Momentum(NamedTuple):
    """p, shape (J,), and (rho, eta), shape (2,)."""

    moving: npt.NDArray[np.float32]
    gains: npt.NDArray[np.float32]


@only_with("internal_loss")
def moving(engine: "Engine") -> Any:
    """p, or None without this effect."""
    return engine.internal_loss.moving


@only_with("internal_loss")
def kept(engine: "Engine") -> Any:
    """rho, or None."""
    return engine.internal_loss.gains[0]


@only_with("internal_loss")
def brake(engine: "Engine") -> Any:
    """eta, or None."""
    return engine.internal_loss.gains[1]


@only_with("internal_loss")
def push(engine: "Engine", junction: int, speed: float) -> None:
    """A force has moved a junction by `speed` in a step: it goes on moving."""
    engine.internal_loss.moving[junction] += np.float32(speed)


@only_with("internal_loss")
def rest(engine: "Engine") -> None:
    """All at rest."""
    engine.internal_loss.moving[:] = np.float32(0.0)
