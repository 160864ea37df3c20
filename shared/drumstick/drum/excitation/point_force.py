"""A force at a place on the head, listed for this step of the mesh: whatever excites the drum goes through here.

It goes to the nearest junction, or to all those around its place by their nearness (`inject = "linear"`), so that a
strike that wanders does not wander in steps. Kernels: audio thread; no allocation.
"""

from typing import TYPE_CHECKING

from drumstick.drum.membrane.interpolation import around
from drumstick.drum.memory.pulses import JunctionForce
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine


@njit()
def _add(engine: "Engine", junction: int, share: float, force: float) -> None:
    # The force counts as one more neighbour of its junction: a junction at the rim has a smaller weight and a smaller
    # mass in proportion, and one outside the head takes no force at all.
    control = engine.control[0]
    weight = float(engine.head.weights[junction])
    if weight > 0.0:
        entry: JunctionForce = engine.forces[control.forces]
        entry.junction = junction
        entry.step = weight * control.force_gain * share * force
        control.forces += 1


@only_with("head")
def push(engine: "Engine", x: float, y: float, force: float) -> None:
    """Push the head at (x, y), in radii, with the mean force (N) over this step."""
    corners, shares = around(engine.head, x, y)
    if engine.control[0].spread != 0:
        for k in range(len(corners)):
            _add(engine, corners[k], shares[k], force)
    else:
        best = 0
        for k in range(1, len(corners)):
            if shares[k] > shares[best]:
                best = k
        _add(engine, corners[best], 1.0, force)
