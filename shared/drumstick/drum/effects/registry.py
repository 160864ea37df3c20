"""The effects of the drum, in the order of the panel and of the documentation; kernels are called in it too.

A new effect is one module of this folder and one line here. The module has

- `TABLE`, the dataclass of `[drum.effects.<name>]`: the scene's keys and the docs follow from it;
- `ON_MODES = True` if a bank of modes can have it too;
  `ON_MESH = False` if only a bank of modes can; `NEEDS`, another effect without which it cannot be, and why;
  `MESH_PICKUPS_ONLY`, why a mesh that has it can have no microphones;
- `FORMER_NAME` if scenes called it otherwise once: they are still read, with a note;
- `part_of(building)`, which lays out what the kernels need as a named tuple: `engine.effects.<name>`, nothing in a
  scene without it. An effect that is in the coefficients of the head has no part. One with a value that is set while
  it plays (declared with a `wire` name) has a record `target` with a field of that name, and moves there in
  `before_sweep`;
- those of the kernels named in `drumstick.drum.effects.composition` that it needs, decorated with `only_with`: above
  all `before_sweep`; `after_sweep`, which moves junctions and says by how much their sum changed; `added_output`, what
  is heard besides the head; `reset`, where all falls asleep; and `resume`, before the first step after that. Each asks
  by name for the arguments it needs. One that hears other drums has their sound as `outside`, and `taken_in`;

- `separated(part, separation)` if pickups hear it: the part without what has an output pair of its own, and the gains
  of that (drumstick.drum.stems.separation); and `moved(part, scene, half)` if they do so at junctions of its own
  (drumstick.drum.membrane.heads);
- `set_level(part, table, peak, blow)` if it sounds beside the head, so that its level is set when the head's is;
- those functions of its table that `head_numbers` asks for: what it does to the head before it sounds, and `mistakes`.
  A table that knows the head's mass per area has it as `head_kg_per_m2`;
- `live_quantities` of its table if not all that have a `wire` name count in each scene: those that do. One that counts
  for nothing is no parameter (drumstick.parameters.declare).

Every effect must be passive: what it gives back it took from the head before, at any step and any strength.
"""

from collections import namedtuple
from types import ModuleType
from typing import Any

from drumstick.drum.effects import (
    air,
    cavity,
    internal_loss,
    kettle,
    muffle,
    rim,
    snare,
    sympathy,
    tension,
    uniform_loss,
)
from drumstick.drum.effects.building import Building
from realtime.records import NOTHING

_IN_ORDER: tuple[ModuleType, ...] = (
    air,
    kettle,
    uniform_loss,
    internal_loss,
    muffle,
    tension,
    cavity,
    sympathy,
    snare,
    rim,
)
EFFECTS: dict[str, ModuleType] = {module.__name__.rpartition(".")[2]: module for module in _IN_ORDER}
# `[drum.effects.<name>]`.
DRUM_TABLES: dict[str, type] = {name: module.TABLE for name, module in EFFECTS.items()}
MESH_EFFECTS = tuple(name for name, module in EFFECTS.items() if getattr(module, "ON_MESH", True))
# Effect -> the one that it needs, and why.
NEEDS: dict[str, tuple[str, str]] = {
    name: module.NEEDS for name, module in EFFECTS.items() if hasattr(module, "NEEDS")
}
# Effect -> why a mesh that has it can have no microphones.
MESH_PICKUPS_ONLY: dict[str, str] = {
    name: module.MESH_PICKUPS_ONLY for name, module in EFFECTS.items() if hasattr(module, "MESH_PICKUPS_ONLY")
}
MODAL_EFFECTS = tuple(name for name, module in EFFECTS.items() if hasattr(module, "ON_MODES"))
# What scenes called an effect once -> its name.
FORMER_NAMES: dict[str, str] = {
    module.FORMER_NAME: name for name, module in EFFECTS.items() if hasattr(module, "FORMER_NAME")
}

# Memory of each effect for the kernels; nothing for those that the scene does not name.
_made: Any = namedtuple  # its fields are known here only
Effects = _made(
    "Effects",
    [name for name, module in EFFECTS.items() if hasattr(module, "part_of")],
    defaults=[NOTHING for module in EFFECTS.values() if hasattr(module, "part_of")],
)


def effects_of(building: Building) -> Any:
    """The parts of all effects that the scene names, laid out for the kernels. Allocates; any thread."""
    parts: dict[str, Any] = {}
    for name, module in EFFECTS.items():
        if name in building.scene.drum.effects and hasattr(module, "part_of"):
            parts[name] = module.part_of(building._replace(parts=parts))
    return Effects(**parts)
