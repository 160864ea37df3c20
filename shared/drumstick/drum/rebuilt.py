"""Values of a drum that are in all its coefficients: for another one, another drum is built beside it. Any thread.

Those of the mallet that strikes it are among them: another one comes with another drum.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, cast

from drumstick.parameters.declare import quantities
from drumstick.parameters.drum import Drum
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.scene import Scene

# Of each table, wire name -> key.
_KEYS: dict[type, dict[str, str]] = {
    table: {row.wire: key for key, row in quantities(table).items() if row.rebuilds and row.wire}
    for table in (Drum, Mallet)
}


def rebuilt_values(scene: Scene) -> dict[str, float]:
    """Wire name -> the scene's own value, of what another drum is built for when it is set."""
    return {
        name: float(getattr(table, key))
        for table in (scene.drum, scene.mallet)
        if table is not None
        for name, key in _KEYS[type(table)].items()
    }


def scene_rebuilt(scene: Scene, values: Mapping[str, float]) -> Scene:
    """The scene whose drum and mallet have these values by wire name, unchecked; what it is not built for is ignored.

    Its effects, its mesh and how it is listened to are the same.
    """

    def changed(table: object) -> Any:
        keys = {key: values[name] for name, key in _KEYS[type(table)].items() if name in values}
        return dataclasses.replace(cast(Any, table), **keys)

    mallet = None if scene.mallet is None else changed(scene.mallet)
    return dataclasses.replace(scene, drum=changed(scene.drum), mallet=mallet)
