"""`drumstick scene list|show|check`."""

import json

from drumstick.scenes.former_names import with_present_names
from drumstick.scenes.scene_text import as_tables, shipped_names
from rig import scene_file
from rig.supervision.preflight import playable, try_drum, try_stick


def show_list(as_json: bool) -> None:
    """Name and words of every shipped scene."""
    found = {name: scene_file.load(name).words for name in shipped_names()}
    print(json.dumps(found) if as_json else "\n".join(f"{name:12s} {words}" for name, words in found.items()))


def show(scene: str, as_json: bool) -> None:
    """The scene's text, with old names renewed, or all its values as JSON."""
    loaded = scene_file.load(scene)
    text = with_present_names(scene_file.read(scene).text)
    print(json.dumps(as_tables(loaded)) if as_json else text.rstrip())


def check(scene: str) -> None:
    """Stop with every mistake, or say that it is good."""
    loaded = scene_file.load(scene)
    scene_file.gesture(scene, loaded)
    try_stick(loaded)
    with playable():
        try_drum(loaded)
    print(f"{loaded.name}: good; effects: {', '.join(loaded.effects) or 'none'}")
