"""The text of a scene: TOML in, frozen tables out; every mistake is named. And the texts that are shipped."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from typing import Any, cast

from drumstick.packages import PackageError
from drumstick.parameters.drum import Drum, Listen, Mesh, Modal
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.rig import Device, Guard, Hand, Servo
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.parameters.strike import Strike
from drumstick.scenes.drum_tables import (
    check_drum,
    check_listen,
    check_mallet,
    check_mesh,
    check_renderer,
    drum_of,
    mallet_of,
    named_tables,
)
from drumstick.scenes.hand_tables import check_hand, hand_of
from drumstick.scenes.reading import Reader, shown, tables_of
from drumstick.scenes.stick_tables import check_scale, stick_of
from drumstick.scenes.strike_tables import check_strike, strike_of
from drumstick.stick.effects import registry
from drumstick.stick.effects.registry import STICK_TABLES

_MAX_LINE = 400
# Tables of a scene that are no effect's, by name.
TABLES: dict[str, type] = {
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
    "hand": hand_of,
}
_OPTIONAL = ("modal", "mallet")  # None in a scene that has none


class SceneError(ValueError):
    """Mistakes in a scene, one line each: file, line, key, value, limit, unit.

    >>> import drumstick as ds
    >>> try:
    ...     ds.scene("[stick]\\nk_coll_N_per_m = -1.0")
    ... except ds.SceneError as error:
    ...     print(error.mistakes)
    ['scene:2: stick.k_coll_N_per_m: -1.0 N/m is outside 1 .. 1e+06 N/m']
    """

    def __init__(self, mistakes: list[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = mistakes


def shipped_names() -> list[str]:
    """Names of the scenes that come with the package, in order.

    >>> import drumstick as ds
    >>> "paper-roll" in ds.scene_names()
    True
    """
    folder = resources.files("drumstick.scenes") / "shipped"
    return sorted(
        entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
    )


def shipped_gesture(file_name: str) -> str:
    """The CSV text of a recorded gesture that comes with a shipped scene; FileNotFoundError when there is none."""
    return (resources.files("drumstick.scenes") / "shipped" / file_name).read_text(encoding="utf-8")


def shipped_text(name: str) -> str:
    """The TOML text of a shipped scene; KeyError when there is none of that name."""
    if name not in shipped_names():
        raise KeyError(name)
    return (resources.files("drumstick.scenes") / "shipped" / f"{name}.toml").read_text(encoding="utf-8")


def _line(reader: Reader, key: str, value: object, fewest: int) -> str:
    if isinstance(value, str) and fewest <= len(value) <= _MAX_LINE and value.isprintable():
        return value
    reader.refuse(key, f"{shown(value)} must be one line of text, {fewest} to {_MAX_LINE} characters")
    return ""


def _read(reader: Reader, key: str, given: object) -> Any:
    read = _READERS.get(key)
    return read(reader, given) if read is not None else reader.table(key, TABLES[key], given)


def _effects(reader: Reader, given: object) -> dict[str, Any]:
    usable: object = given
    if isinstance(given, dict):
        usable = named = dict(cast(dict[str, object], given))
        for name in tuple(named):
            try:
                registry.find(name)
            except PackageError as error:
                reader.refuse(f"effects.{name}", str(error))
                del named[name]
    return named_tables(reader, "effects", STICK_TABLES, usable)


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
            values["effects"] = _effects(reader, value)
        elif key in TABLES:
            values[key] = _read(reader, key, value)
        else:
            reader.refuse(key, f"unknown key; known here: name, words, effects, {', '.join(TABLES)}")
    drum, hand = values.get("drum", Drum()), values.get("hand", Hand())
    check_hand(reader, hand, values.get("device", Device()), drum, values.get("effects", {}))
    check_drum(reader, drum)
    check_renderer(reader, drum, given)
    check_mallet(reader, drum, given)
    check_scale(reader, values.get("stick", Stick()), values.get("effects", {}))
    check_strike(reader, values.get("strike", Strike()), drum)
    if drum.excitation == "mallet" and "mallet" not in values:
        values["mallet"] = mallet_of(reader, {})
    check_mesh(reader, values.get("mesh", Mesh()), given)
    check_listen(reader, values.get("listen", Listen()), drum, given)
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
    for key in TABLES:
        if not (key in _OPTIONAL and tables.get(key) is None):
            values[key] = _read(reader, key, _listed(tables.get(key, {})))
    values["effects"] = _effects(reader, tables.get("effects", {}))
    check_hand(reader, values["hand"], values["device"], values["drum"], values["effects"])
    check_drum(reader, values["drum"])
    named = [key for key in _OPTIONAL if key in values]
    check_renderer(reader, values["drum"], named)
    check_mallet(reader, values["drum"], named)
    check_scale(reader, values["stick"], values["effects"])
    check_strike(reader, values["strike"], values["drum"])
    if values["drum"].excitation == "mallet" and "mallet" not in values:
        values["mallet"] = mallet_of(reader, {})
    check_mesh(reader, values["mesh"], named)
    check_listen(reader, values["listen"], values["drum"], named)
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
