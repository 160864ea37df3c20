"""The records that the kernels get: the scene's law (parameters) and the stick's motion (state).

Both are numpy record types made from the declarations, so an effect that the scene does not name has no field
in either, and numba compiles no code for it. Field names are the wire names; words of a choice become their
index. Effects come first: numba takes a record that merely continues another one for its subtype, and warns.
"""

import functools
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.parameters.declare import Quantity, quantities
from drumstick.parameters.scene import Scene
from drumstick.stick.effects.registry import EFFECTS
from drumstick.stick.records import StickLaw, StickMotion
from realtime.records import fields_of

Records = npt.NDArray[np.void]


def field_of(key: str, quantity: Quantity) -> str:
    """The record's field: the wire name without its effect, or the scene's key."""
    return (quantity.wire or key).rpartition(".")[2]


@functools.cache
def law_type(effects: tuple[str, ...]) -> np.dtype[np.void]:
    """Record type of the parameters of a scene that names these effects."""
    nested: list[Any] = [(name, fields_of(EFFECTS[name].LAW)) for name in effects]
    return np.dtype([*nested, *fields_of(StickLaw)], align=True)


@functools.cache
def motion_type(effects: tuple[str, ...]) -> np.dtype[np.void]:
    """Record type of the state of a scene that names these effects."""
    states = {name: fields_of(EFFECTS[name].STATE) for name in effects}
    nested: list[Any] = [(name, fields) for name, fields in states.items() if fields]
    return np.dtype([*nested, *fields_of(StickMotion)], align=True)


def _fill(record: Any, table: object) -> None:
    for key, quantity in quantities(type(table)).items():
        value = getattr(table, key)
        if quantity.choices and quantity.kind is str:
            value = quantity.choices.index(value)
        record[field_of(key, quantity)] = value


def law_of(scene: Scene) -> Records:
    """The scene's parameters, shape (1,)."""
    law = np.zeros(1, law_type(tuple(scene.effects)))
    _fill(law[0], scene.stick)
    for name, table in scene.effects.items():
        _fill(law[0][name], table)
    return law


def thrown(scene: Scene, v0: float) -> Records:
    """A stick at z = 0 that moves up at v0 >= 0 m/s (or down into the head), shape (1,)."""
    motion = np.zeros(1, motion_type(tuple(scene.effects)))
    motion["v"] = v0
    return motion
