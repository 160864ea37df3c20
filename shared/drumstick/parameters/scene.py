"""A scene: which physics is computed, with which numbers. Text in, frozen tables out; every mistake is named.

A table that the text does not name is absent (an effect) or has its defaults (`[stick]`, `[drum]` ...).
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any, cast

from drumstick.parameters.drum import Drum, Listen, Mesh, Modal
from drumstick.parameters.drum_tables import (
    check_drum,
    check_listen,
    check_mallet,
    check_mesh,
    check_renderer,
    drum_of,
    named_tables,
)
from drumstick.parameters.mallet import Mallet, mallet_of
from drumstick.parameters.reading import Reader, shown, tables_of
from drumstick.parameters.rig import Device, Guard, Hand, Servo
from drumstick.parameters.stick import Stick
from drumstick.parameters.stick_tables import stick_of
from drumstick.parameters.strike import Strike, check_strike, strike_of
from drumstick.stick.effects import registry

# In the order in which they are summed.
EFFECTS: dict[str, type] = {name: module.TABLE for name, module in registry.EFFECTS.items()}

_MAX_LINE = 400
_TABLES: dict[str, type] = {
    "stick": Stick,
    "drum": Drum,
    "mesh": Mesh,
    "modal": Modal,
    "mallet": Mallet,
    "listen": Listen,
    "strike": Strike,
    "hand": Hand,
    "device": Device,
    "servo": Servo,
    "guard": Guard,
}


# Tables that are read by more than their declarations.
_READERS: dict[str, Callable[[Reader, object], Any]] = {
    "stick": stick_of,
    "drum": drum_of,
    "mallet": mallet_of,
    "strike": strike_of,
}
_OPTIONAL = ("modal", "mallet")  # None in a scene that has none


class SceneError(ValueError):
    """Mistakes in a scene, one line each: file, line, key, value, limit, unit."""

    def __init__(self, mistakes: list[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = mistakes


@dataclass(frozen=True)
class Scene:
    """A validated scene. `effects` holds only what the text named, always in the order of EFFECTS.

    One order, or the same effects would be another record type for each order, and all kernels compiled again.
    """

    name: str
    words: str = ""
    stick: Stick = field(default_factory=Stick)
    effects: Mapping[str, Any] = field(default_factory=dict[str, Any])
    drum: Drum = field(default_factory=Drum)
    mesh: Mesh = field(default_factory=Mesh)
    modal: Modal | None = None  # instead of the mesh
    mallet: Mallet | None = None  # where it excites the drum
    listen: Listen = field(default_factory=Listen)
    strike: Strike = field(default_factory=Strike)
    hand: Hand = field(default_factory=Hand)
    device: Device = field(default_factory=Device)
    servo: Servo = field(default_factory=Servo)
    guard: Guard = field(default_factory=Guard)

    def __post_init__(self) -> None:
        ordered = {name: self.effects[name] for name in EFFECTS if name in self.effects}
        object.__setattr__(self, "effects", ordered)


def shipped_names() -> list[str]:
    """Names of the scenes that come with the package."""
    folder = resources.files("drumstick.parameters") / "scenes"
    return sorted(
        entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
    )


def shipped_gesture(file_name: str) -> str:
    """The CSV text of a recorded gesture that comes with a shipped scene; FileNotFoundError when there is none."""
    return (resources.files("drumstick.parameters") / "scenes" / file_name).read_text(encoding="utf-8")


def shipped_text(name: str) -> str:
    """The TOML text of a shipped scene; KeyError when there is none of that name."""
    if name not in shipped_names():
        raise KeyError(name)
    return (resources.files("drumstick.parameters") / "scenes" / f"{name}.toml").read_text(encoding="utf-8")


def _check_gesture(reader: Reader, hand: Hand, device: Device) -> None:
    if hand.gesture != "recorded":
        if hand.gesture_file:
            reader.refuse("hand.gesture_file", 'is followed only by gesture = "recorded"')
        return
    if not hand.gesture_file:
        reader.refuse("hand.gesture_file", "missing: a recorded gesture needs its CSV file, with t_s and z_m")
    if device.plant != "phantom":
        reader.refuse(
            "hand.gesture", 'a recorded gesture moves a sampled arm: set [device] plant = "phantom"'
        )


def _line(reader: Reader, key: str, value: object, fewest: int) -> str:
    if isinstance(value, str) and fewest <= len(value) <= _MAX_LINE and value.isprintable():
        return value
    reader.refuse(key, f"{shown(value)} must be one line of text, {fewest} to {_MAX_LINE} characters")
    return ""


def _read(reader: Reader, key: str, given: object) -> Any:
    read = _READERS.get(key)
    return read(reader, given) if read is not None else reader.table(key, _TABLES[key], given)


def parse(text: str, source: str, notes: list[str] | None = None) -> Scene:
    """Read a scene's TOML text; `source` names it in messages. Raises SceneError with every mistake found.

    `notes` gets what is read all the same, and should be written otherwise: one line each, for whoever gave the text.
    """
    try:
        given = tables_of(text)
    except ValueError as error:
        raise SceneError([f"{source}: not valid TOML: {error}"]) from None
    reader = Reader(source, text)
    values: dict[str, Any] = {"name": source.rpartition("/")[2].removesuffix(".toml")}
    for key, value in given.items():
        if key in ("name", "words"):
            values[key] = _line(reader, key, value, 1)
        elif key == "effects":
            values["effects"] = named_tables(reader, "effects", EFFECTS, value)
        elif key in _TABLES:
            values[key] = _read(reader, key, value)
        else:
            reader.refuse(key, f"unknown key; known here: name, words, effects, {', '.join(_TABLES)}")
    _check_gesture(reader, values.get("hand", Hand()), values.get("device", Device()))
    drum = values.get("drum", Drum())
    check_drum(reader, drum)
    check_renderer(reader, drum, given)
    check_mallet(reader, drum, given)
    check_strike(reader, values.get("strike", Strike()), drum)
    if drum.excitation == "mallet" and "mallet" not in values:
        values["mallet"] = mallet_of(reader, {})
    check_mesh(reader, values.get("mesh", Mesh()), given)
    check_listen(reader, values.get("listen", Listen()))
    if notes is not None:
        notes += reader.notes
    if reader.mistakes:
        raise SceneError(reader.mistakes)
    return Scene(**values)


def as_tables(scene: Scene) -> dict[str, Any]:
    """The scene as plain tables with every default written out: what the `scene` query answers."""
    return dataclasses.asdict(scene)


def from_tables(tables: Mapping[str, Any]) -> Scene:
    """The inverse of `as_tables`, checked like any scene; lists may stand for tuples. Raises SceneError."""
    reader = Reader("scene", "")
    values: dict[str, Any] = {key: _line(reader, key, tables.get(key, ""), 0) for key in ("name", "words")}
    for key in _TABLES:
        if not (key in _OPTIONAL and tables.get(key) is None):
            values[key] = _read(reader, key, _listed(tables.get(key, {})))
    values["effects"] = named_tables(reader, "effects", EFFECTS, tables.get("effects", {}))
    _check_gesture(reader, values["hand"], values["device"])
    check_drum(reader, values["drum"])
    named = [key for key in _OPTIONAL if key in values]
    check_renderer(reader, values["drum"], named)
    check_mallet(reader, values["drum"], named)
    check_strike(reader, values["strike"], values["drum"])
    if values["drum"].excitation == "mallet" and "mallet" not in values:
        values["mallet"] = mallet_of(reader, {})
    check_mesh(reader, values["mesh"], named)
    check_listen(reader, values["listen"])
    if reader.mistakes:
        raise SceneError(reader.mistakes)
    return Scene(**values)


def _as_list(value: object) -> object:
    if not isinstance(value, tuple | list):
        return value
    return [_as_list(item) for item in cast(Sequence[object], value)]


def _listed(table: object) -> object:
    if not isinstance(table, dict):
        return table
    entries = cast(dict[str, object], table)
    return {k: _as_list(_listed(v)) for k, v in entries.items()}
