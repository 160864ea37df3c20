"""The records that the kernels get: the scene's law (parameters) and the stick's motion (state).

Both are numpy record types made from the declarations, so an effect that the scene does not name has no field
in either, and numba compiles no code for it. The drum's live values are in the law too, in a part
that no kernel of the stick reads: a set then applies whole, and survives a restart of the gateway. They stand there by
their places, so that the same stick on another drum has the same record and is not compiled again; a word says whose
places they are. Field names are the wire names; words of a choice become their index. Effects come first: numba takes a
record that merely continues another one for its subtype, and warns.
"""

import functools
import hashlib
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.parameters.declare import Quantity, live_quantities, quantities
from drumstick.parameters.pickups import live_pickups
from drumstick.parameters.scene import Scene
from drumstick.stick.effects.registry import EFFECTS, in_order
from drumstick.stick.records import Law, Motion, field_of
from realtime.records import fields_of

Records = npt.NDArray[np.void]
DRUM = "drum"  # the part of the law's record that holds the drum's live values, by their places
_PLACES_OF = "places_of"  # tells the drum's live values, by their names, from those of a drum that has others
_PLACES = 16  # of the drum, or as many times as many: more than any scene that is shipped needs


@functools.cache
def law_type(effects: tuple[str, ...], live: int = 0) -> np.dtype[np.void]:
    """Record type of the parameters of a scene that names these effects. live: how many live values its drum has."""
    nested: list[Any] = [(name, fields_of(EFFECTS[name].LAW)) for name in effects]
    places = _PLACES * max(1, -(-live // _PLACES))
    return np.dtype([*nested, (DRUM, "f8", (places,)), (_PLACES_OF, "i8"), *fields_of(Law)], align=True)


@functools.cache
def motion_type(effects: tuple[str, ...]) -> np.dtype[np.void]:
    """Record type of the state of a scene that names these effects."""
    states = {name: fields_of(EFFECTS[name].STATE) for name in effects}
    nested: list[Any] = [(name, fields) for name, fields in states.items() if fields]
    return np.dtype([*nested, *fields_of(Motion)], align=True)


def drum_field(wire: str) -> str:
    """The field of what the drum keeps that holds its live value of that wire name."""
    return wire.replace(".", "_")


def _declared(table: object) -> dict[str, Quantity]:
    return quantities(type(table))


def _fill(record: Any, table: object) -> None:
    for key, quantity in _declared(table).items():
        value = getattr(table, key)
        if quantity.choices and quantity.kind is str:
            value = quantity.choices.index(value)
        record[field_of(key, quantity)] = value


def live_in_drum(scene: Scene) -> dict[str, tuple[Quantity, float]]:
    """Wire name -> declaration and the scene's own value, of what can be set live in its drum: of the drum itself, of
    its effects, of the mallet that strikes it, then of how it is listened to, and of pickups that can be moved. In the
    order of their places in the law."""
    mallets = () if scene.mallet is None else (scene.mallet,)
    declared = {
        quantity.wire: (quantity, float(getattr(table, key)))
        for table in (scene.drum, *scene.drum.effects.values(), *mallets, scene.listen)
        for key, quantity in live_quantities(table).items()
        if quantity.wire is not None
    }
    return declared | live_pickups(scene.listen)


def law_of(scene: Scene) -> Records:
    """The scene's parameters, shape (1,)."""
    drum = live_in_drum(scene)
    law = np.zeros(1, law_type(in_order(scene.effects), len(drum)))
    law[0][DRUM][: len(drum)] = [value for _, value in drum.values()]
    law[0][_PLACES_OF] = int.from_bytes(hashlib.sha256(" ".join(drum).encode()).digest()[:7])
    _fill(law[0], scene.stick)
    for name, table in scene.effects.items():
        _fill(law[0][name], table)
    return law


def thrown(scene: Scene, v0: float) -> Records:
    """A stick at z = 0 that moves up at v0 >= 0 m/s (or down into the head), shape (1,)."""
    motion = np.zeros(1, motion_type(in_order(scene.effects)))
    motion["v"] = v0
    return motion
