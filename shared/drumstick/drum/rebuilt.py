"""Values of a drum that are in all its coefficients: for another one, another drum is built beside it. Any thread."""

import dataclasses
from collections.abc import Mapping

from drumstick.parameters.declare import quantities
from drumstick.parameters.drum import Drum
from drumstick.parameters.scene import Scene

# Wire name -> key of `[drum]`.
_KEYS = {
    quantity.wire: key for key, quantity in quantities(Drum).items() if quantity.rebuilds and quantity.wire
}


def rebuilt_values(scene: Scene) -> dict[str, float]:
    """Wire name -> the scene's own value, of what another drum is built for when it is set."""
    return {name: float(getattr(scene.drum, key)) for name, key in _KEYS.items()}


def scene_rebuilt(scene: Scene, values: Mapping[str, float]) -> Scene:
    """The scene whose drum has these values by wire name, unchecked; what it is not built for is ignored.

    Its effects, its mesh and how it is listened to are the same.
    """
    changed = {key: values[name] for name, key in _KEYS.items() if name in values}
    return dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, **changed))
