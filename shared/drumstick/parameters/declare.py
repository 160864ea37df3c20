"""Declaring a number where its physics stands: unit, range, words and wire name, once.

A table of a scene (`[stick]`, `[effects.pulse]`, `[drum]` ...) is a frozen dataclass whose fields are made by
the functions here. The scene reader, the parameter table, the record that the kernels get, the OSC and Zenoh
names and the panel's controls are all derived from these declarations.
"""

import dataclasses
from dataclasses import dataclass, field
from typing import Any, Literal, TypedDict, Unpack, cast

Scale = Literal["linear", "log"]


@dataclass(frozen=True)
class Quantity:
    """Declaration of one key of a scene: unit, range, words.

    `wire` is the name on the wire of a value that can be set live; `scale` maps it to 0..1 for DAWs. `rebuilds`: a
    drum of the new value is built beside the one that plays, and takes its place.
    `choices` lists the permitted words or integers of a choice; then low, high and unit mean nothing.
    """

    kind: type
    low: float = 0.0
    high: float = 0.0
    unit: str = ""
    words: str = ""
    symbol: str = ""
    equation: str = ""
    wire: str | None = None
    scale: Scale = "linear"
    above_head_only: bool = True
    rebuilds: bool = False
    choices: tuple[str | int, ...] = ()
    length: int = 0
    fewest: int = 1


class _More(TypedDict, total=False):
    # What a number may have besides, as in Quantity.
    symbol: str
    equation: str
    wire: str
    scale: Scale
    rebuilds: bool


def number(default: float, low: float, high: float, unit: str, words: str, **more: Unpack[_More]) -> Any:
    """A finite real number, low <= value <= high; by name also its symbol, equation, wire name and scale.

    Field of a dataclass that is a table of a scene. `wire` is its name for OSC and Zenoh, if it can be set live; scale:
    "linear" or "log".

    >>> from dataclasses import dataclass
    >>> import drumstick as ds
    >>> @dataclass(frozen=True)
    ... class Sticky:
    ...     force_N: float = ds.number(0.2, 0.0, 5.0, "N", "How strongly it holds", wire="sticky.force")
    >>> Sticky()
    Sticky(force_N=0.2)
    """
    quantity = Quantity(float, low, high, unit, words, **more)
    return field(default=default, metadata={"quantity": quantity})


def required(low: float, high: float, unit: str, words: str) -> Any:
    """A finite real number that must be given wherever its table is."""
    return field(metadata={"quantity": Quantity(float, low, high, unit, words)})


def count(default: int, low: int, high: int, unit: str, words: str) -> Any:
    """An integer, low <= value <= high."""
    return field(default=default, metadata={"quantity": Quantity(int, low, high, unit, words)})


def choice(default: str | int, choices: tuple[str | int, ...], words: str) -> Any:
    """One of a few words or integers."""
    quantity = Quantity(type(default), words=words, choices=choices)
    return field(default=default, metadata={"quantity": quantity})


def text(default: str, words: str) -> Any:
    """A short line of text."""
    return field(default=default, metadata={"quantity": Quantity(str, high=200, words=words)})


def numbers(
    default: tuple[tuple[float, ...], ...], length: int, low: float, high: float, unit: str, words: str
) -> Any:
    """Up to 16 rows of `length` numbers each, e.g. positions of pickups; at least one, unless none is the default."""
    quantity = Quantity(tuple, low, high, unit, words, length=length, fewest=min(len(default), 1))
    return field(default=default, metadata={"quantity": quantity})


def quantities(table: type) -> dict[str, Quantity]:
    """Key -> declaration, in the order of declaration, of one table's dataclass."""
    declared = [f for f in dataclasses.fields(table) if "quantity" in f.metadata]
    return {f.name: cast(Quantity, f.metadata["quantity"]) for f in declared}


def live_quantities(table: object) -> dict[str, Quantity]:
    """Key -> declaration of what can be set live in this table of a scene, in the order of declaration.

    That is what has a wire name. A table in which some of it would change nothing has a method of this name, which
    says what remains.
    """
    declared = {
        key: quantity for key, quantity in quantities(type(table)).items() if quantity.wire is not None
    }
    return cast(Any, table).live_quantities(declared) if hasattr(table, "live_quantities") else declared


def require_in_range(table: object, name: str) -> None:
    """Raise ValueError, worded as a scene's reader words it, for a number of a table outside what is declared."""
    for key, quantity in quantities(type(table)).items():
        value = getattr(table, key)
        if quantity.kind is float and not quantity.low <= value <= quantity.high:
            unit = quantity.unit
            raise ValueError(
                f"{name}.{key}: {value:g} {unit} is outside {quantity.low:g} .. {quantity.high:g} {unit}"
            )
