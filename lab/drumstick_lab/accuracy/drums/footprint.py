"""Memory of a drum's arrays, and the time that it takes of a strike itself. Any thread."""

import dataclasses
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene

ABOVE = 0.01  # of the peak: as lab/drumstick_lab/benchmarks/latency/first_samples.py has it
_AT_S, _HEARD_S = 0.05, 0.1
_PLACE = (0.45, 0.0)


def bytes_of(part: Any) -> int:
    """Bytes of all arrays in a named tuple of arrays and named tuples; one that is there twice counts once."""
    owners: dict[int, int] = {}

    def look(each: Any) -> None:
        if isinstance(each, np.ndarray):
            array = cast("npt.NDArray[Any]", each)
            while isinstance(array.base, np.ndarray):
                array = array.base
            owners[id(array)] = array.nbytes
        elif isinstance(each, tuple):
            for inner in cast("tuple[Any, ...]", each):
                look(inner)

    look(part)
    return sum(owners.values())


def memory_bytes(scene: Scene, rate_Hz: int) -> int:
    """Bytes of the arrays of the scene's drum, ready to play."""
    return bytes_of(new_engine(scene, rate_Hz, StrikeRing()))


def late_s(scene: Scene, rate_Hz: int) -> float:
    """From a strike's instant to the first sample above ABOVE of its peak, where a pickup lies under the strike: the mesh's
    step and its interpolator, and the rise of the blow."""
    listen = dataclasses.replace(scene.listen, pickups=((*_PLACE, 0.0),), microphones=())
    blow = strike_for_speed(scene, 0.5 * scene.strike.full_scale_m_per_s, *_PLACE, _AT_S)
    loud = np.abs(render(dataclasses.replace(scene, listen=listen), [blow], _HEARD_S, rate_Hz)[:, 0])
    return float(np.argmax(loud > ABOVE * loud.max())) / rate_Hz - _AT_S
