"""Drums that are compared with recorded ones: of which kind, beside which, as which scene, and where they are struck."""

import dataclasses

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text

# Which kind a scene is of, "" where no kit has one; and which of the recordings it was made beside, "" for none.
KINDS = {
    "high-tom": ("tom", "Forzee High"),
    "mid-tom": ("tom", "Forzee Mid"),
    "low-tom": ("tom", "Forzee Low"),
    "tom": ("tom", ""),
    "snare": ("snare", "Forzee snare"),
    "bass-drum": ("bass drum", "Forzee bass drum"),
    "snare, strainer off": ("snare", "Forzee snare, wires off"),
    "conga": ("hand drum", ""),
    "frame-drum": ("", ""),
    "timpani": ("", ""),
    "low-timpani": ("", ""),
}
PLACE = 0.3  # of the radius: where the drums of a drum set are struck, ours as if theirs were
DRUM_SET = ("tom", "snare", "bass drum")
# A second recording, of another kit, that the scene was made beside: it shall lie between the two.
ALSO_BESIDE = {"high-tom": "Colombo 12-inch", "mid-tom": "Colombo 13-inch", "low-tom": "Colombo 16-inch"}
# Fitted to all that `WORK` has of its kind, and like none of them: no kit has a recorded conga.
BESIDE_ALL = {"conga": "median of five djembes"}


def scene_of(name: str) -> Scene:
    """The scene of a row of KINDS."""
    shipped, _, off = name.partition(", ")
    scene = parse(shipped_text(shipped), f"{shipped}.toml")
    if not off:
        return scene
    wires = dataclasses.replace(scene.drum.effects["snare"], strainer=0.0)
    drum = dataclasses.replace(scene.drum, effects={**scene.drum.effects, "snare": wires})
    return dataclasses.replace(scene, drum=drum)


def place_of(name: str) -> float:
    """Place at which the drum of a row of KINDS is struck, share of the radius: PLACE in a drum set, else its scene's."""
    return PLACE if KINDS[name][0] in DRUM_SET else scene_of(name).hand.orbit_radius
