"""Check of a drum's live values together. Any thread."""

from collections.abc import Mapping

from drumstick.drum.effects import head_numbers
from drumstick.drum.rebuilt import scene_rebuilt
from drumstick.parameters.pickups import pickups_off_head, with_pickups_at
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Refusal


def require_drum(scene: Scene, values: Mapping[str, float]) -> None:
    """Raise Refusal, worded, where these values by wire name make a drum that no scene may have."""
    for words in pickups_off_head(with_pickups_at(scene.listen, values)):
        raise Refusal(words)
    drum = scene_rebuilt(scene, values).drum
    for effect, key, words in head_numbers.mistakes(drum):
        raise Refusal(
            f"the drum could not be so: {'.'.join(filter(None, ('drum.effects', effect, key)))} {words}"
        )
