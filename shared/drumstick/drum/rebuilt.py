"""Values of a drum that are in all its coefficients: for another one, another drum is built beside it. Any thread.

Those of the mallet that strikes it are among them: another one comes with another drum.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, cast

from drumstick.parameters.declare import live_quantities
from drumstick.parameters.scene import Scene


def _keys(table: object) -> dict[str, str]:
    # Wire name -> key.
    return {row.wire: key for key, row in live_quantities(table).items() if row.rebuilds and row.wire}


def rebuilt_values(scene: Scene) -> dict[str, float]:
    """Wire name -> the scene's own value, of what another drum is built for when it is set."""
    return {
        name: float(getattr(table, key))
        for table in (scene.drum, *scene.drum.effects.values(), scene.mallet)
        if table is not None
        for name, key in _keys(table).items()
    }


def scene_rebuilt(scene: Scene, values: Mapping[str, float]) -> Scene:
    """The scene whose drum, effects and mallet have these values by wire name, unchecked; others are ignored.

    Which effects it has, its mesh and how it is listened to are the same.
    """

    def changed(table: object) -> Any:
        keys = {key: values[name] for name, key in _keys(table).items() if name in values}
        return dataclasses.replace(cast(Any, table), **keys)

    mallet = None if scene.mallet is None else changed(scene.mallet)
    effects = {name: changed(table) for name, table in scene.drum.effects.items()}
    return dataclasses.replace(
        scene, drum=dataclasses.replace(changed(scene.drum), effects=effects), mallet=mallet
    )
