"""A scene's stick, hand and head without pulses: what alpha, beta and the capture speed are about.

Effects whose motion never repeats are left out as well: a restitution that depends on a random force, or on the phase
of a sampling clock, is not one number.
"""

import dataclasses

from drumstick.parameters.scene import Scene
from drumstick.stick.effects.registry import names_with, strength_of
from drumstick.stick.law import Records, law_of

# Their motion has no return map that repeats: seeded noise, the logistic map's own state, a free-running clock.
NEVER_REPEATING = names_with("NEVER_REPEATS")
_PULSES = names_with("pulses")


def why_no_roll(scene: Scene) -> str:
    """Reason why this scene's roll has no rate and level to ask for; "" when it has."""
    why = ""
    if "pulse" not in scene.effects:
        why = f"{scene.name} has no pulse ([effects.pulse])"
    elif wild := [name for name in NEVER_REPEATING if name in scene.effects]:
        why = f"with {', '.join(wild)} the motion never repeats"
    elif scene.hand_moves_stick or (scene.device.plant == "phantom" and scene.hand.gesture != "hold"):
        why = f"the hand of {scene.name} moves as its gesture says ([hand] gesture = {scene.hand.gesture!r})"
    return f"{why}: it makes no roll whose rate and level could be set" if why else ""


def repeating(scene: Scene) -> Scene:
    """The scene without the effects of NEVER_REPEATING."""
    effects = {name: table for name, table in scene.effects.items() if name not in NEVER_REPEATING}
    return dataclasses.replace(scene, effects=effects)


def unpulsed(law: Records) -> Records:
    """A copy of `law`, shape (1,), whose pulses give nothing: the same record type, so nothing compiles anew."""
    still = law.copy()
    for name in _PULSES:
        if name in (still.dtype.names or ()):
            still[name][strength_of(name)] = 0.0
    return still


def unpulsed_law(scene: Scene) -> Records:
    """The law of `repeating(scene)` without pulses, shape (1,)."""
    return unpulsed(law_of(repeating(scene)))
