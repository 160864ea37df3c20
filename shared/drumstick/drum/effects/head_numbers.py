"""Numbers of a head as the drum's effects leave them, before it sounds: each is asked by the name of a function.

A function of an effect's module that is asked here gets the effect's table; one that the module does not have adds
nothing. Any thread; allocates.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

from drumstick.drum.effects.registry import EFFECTS
from drumstick.parameters.drum import Drum


class Mistake(NamedTuple):
    """Mistake that only several values together can make: the effect, its key or none, and words."""

    effect: str
    key: str
    words: str


def _answers(drum: Drum, hook: str, *given: Any) -> Iterator[Any]:
    # Of those effects that the scene names and that have the function, in the order of the registry.
    for name, module in EFFECTS.items():
        if name in drum.effects and hasattr(module, hook):
            yield getattr(module, hook)(drum.effects[name], *given)


def even_losses_per_s(drum: Drum) -> float:
    """1/t60 that all modes lose alike besides the drum's own."""
    return sum(_answers(drum, "even_loss_per_s"), start=0.0)


def rising_loss(drum: Drum) -> tuple[float, float] | None:
    """Time, s, in which a mode at so many Hz falls by 60 dB, where high modes lose more; None where none do."""
    return next(_answers(drum, "rising_loss"), None)


def spring(drum: Drum, step_s: float) -> float:
    """K T^2 of what holds the whole head like a spring."""
    return sum(_answers(drum, "spring", step_s), start=0.0)


def tension_rise(drum: Drum) -> float | None:
    """The most that the tension may rise, over the tension at rest; None where it is constant."""
    return next(_answers(drum, "tension_rise"), None)


def are_in_metres(drum: Drum) -> bool:
    """True when an effect asks for metres: how far the head really moves."""
    return any(_answers(drum, "is_in_metres"))


def damping_patches(drum: Drum) -> tuple[tuple[tuple[float, ...], ...], float] | None:
    """Patches (x, y, radius) that damp the head under them, and the time, s, in which they alone would take 60 dB of
    it at full pressure; None where nothing lies on it."""
    return next(_answers(drum, "damping_patches"), None)


def mistakes(drum: Drum) -> Iterator[Mistake]:
    """Mistakes in the effects' values beside the drum's, or together."""
    for name, module in EFFECTS.items():
        if name in drum.effects and hasattr(module, "mistakes"):
            for key, words in module.mistakes(drum.effects[name], drum):
                yield Mistake(name, key, words)
