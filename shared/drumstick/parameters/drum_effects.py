"""Tables of the drum's effects: `[drum.effects.NAME]`. Absent unless named; declared with each effect."""

from drumstick.drum.effects.air import AirTable as Air
from drumstick.drum.effects.cavity import CavityTable as Cavity
from drumstick.drum.effects.internal_loss import InternalLossTable as InternalLoss
from drumstick.drum.effects.kettle import KettleTable as Kettle
from drumstick.drum.effects.muffle import MuffleTable as Muffle
from drumstick.drum.effects.registry import EFFECTS, FORMER_NAMES, MESH_EFFECTS, MODAL_EFFECTS, NEEDS
from drumstick.drum.effects.rim import RimTable as Rim
from drumstick.drum.effects.snare import SnareTable as Snare
from drumstick.drum.effects.tension import TensionTable as Tension
from drumstick.drum.effects.uniform_loss import UniformLossTable as UniformLoss

__all__ = [
    "DRUM_EFFECTS",
    "FORMER_NAMES",
    "MESH_EFFECTS",
    "MODAL_EFFECTS",
    "NEEDS",
    "Air",
    "Cavity",
    "InternalLoss",
    "Kettle",
    "Muffle",
    "Rim",
    "Snare",
    "Tension",
    "UniformLoss",
]

DRUM_EFFECTS: dict[str, type] = {name: module.TABLE for name, module in EFFECTS.items()}
