"""Drums that are compared with recorded ones: of which kind, beside which, and as which scene."""

import dataclasses

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text

# Which kind a scene is of, and which of the recordings it was made beside; "" where no kit has one.
KINDS = {
    "high-tom": ("tom", "Forzee High"),
    "mid-tom": ("tom", "Forzee Mid"),
    "low-tom": ("tom", "Forzee Low"),
    "tom": ("tom", ""),
    "snare": ("snare", "Forzee snare"),
    "bass-drum": ("bass drum", "Forzee bass drum"),
    "snare, strainer off": ("snare", "Forzee snare, wires off"),
    "conga": ("", ""),
    "frame-drum": ("", ""),
    "timpani": ("", ""),
    "low-timpani": ("", ""),
}
# A second recording, of another kit, that the scene was made beside: it shall lie between the two.
ALSO_BESIDE = {"high-tom": "Colombo 12-inch", "mid-tom": "Colombo 13-inch", "low-tom": "Colombo 16-inch"}


def scene_of(name: str) -> Scene:
    """The scene of a row of KINDS."""
    shipped, _, off = name.partition(", ")
    scene = parse(shipped_text(shipped), f"{shipped}.toml")
    if not off:
        return scene
    wires = dataclasses.replace(scene.drum.effects["snare"], strainer=0.0)
    drum = dataclasses.replace(scene.drum, effects={**scene.drum.effects, "snare": wires})
    return dataclasses.replace(scene, drum=drum)
