"""A scene: which physics is computed, with which numbers. Text in, frozen tables out; every mistake is named.

A table that the text does not name is absent (an effect) or has its defaults (`[stick]`, `[drum]` ...).
"""

import dataclasses
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any, cast

from drumstick.declare import Quantity, quantities
from drumstick.drum import Drum, Listen, Mesh
from drumstick.effects.chaos import Chaos
from drumstick.effects.cor_pulse import CorPulse
from drumstick.effects.hysteretic_spring import HystereticSpring
from drumstick.effects.negative_damping import NegativeDamping
from drumstick.effects.noise import Noise
from drumstick.effects.pulse import Pulse
from drumstick.effects.system_delay import SystemDelay
from drumstick.rig import Device, Guard, Hand, Servo, Strike
from drumstick.stick import Stick

# The order here is the order in which effects are summed: part of the contract.
EFFECTS: dict[str, type] = {
    "pulse": Pulse,
    "cor_pulse": CorPulse,
    "system_delay": SystemDelay,
    "hysteretic_spring": HystereticSpring,
    "negative_damping": NegativeDamping,
    "noise": Noise,
    "chaos": Chaos,
}

_TABLES: dict[str, type] = {
    "stick": Stick,
    "drum": Drum,
    "mesh": Mesh,
    "listen": Listen,
    "strike": Strike,
    "hand": Hand,
    "device": Device,
    "servo": Servo,
    "guard": Guard,
}


class SceneError(ValueError):
    """What is wrong with a scene, one line per mistake: file, line, key, value, limit, unit."""

    def __init__(self, mistakes: list[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = mistakes


@dataclass(frozen=True)
class Scene:
    """A validated scene. `effects` holds only what the text named."""

    name: str
    words: str = ""
    stick: Stick = field(default_factory=Stick)
    effects: Mapping[str, Any] = field(default_factory=dict[str, Any])
    drum: Drum = field(default_factory=Drum)
    mesh: Mesh = field(default_factory=Mesh)
    listen: Listen = field(default_factory=Listen)
    strike: Strike = field(default_factory=Strike)
    hand: Hand = field(default_factory=Hand)
    device: Device = field(default_factory=Device)
    servo: Servo = field(default_factory=Servo)
    guard: Guard = field(default_factory=Guard)


def shipped_names() -> list[str]:
    """Names of the scenes that come with the package."""
    folder = resources.files("drumstick") / "scenes"
    return sorted(
        entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
    )


def shipped_text(name: str) -> str:
    """The TOML text of a shipped scene; KeyError when there is none of that name."""
    if name not in shipped_names():
        raise KeyError(name)
    return (resources.files("drumstick") / "scenes" / f"{name}.toml").read_text(encoding="utf-8")


_HEADER = re.compile(r"^\s*\[+\s*([^\[\]#]+?)\s*\]+")
_KEY = re.compile(r"^\s*([A-Za-z0-9_.\"'-]+?)\s*=")


def _lines(source: str) -> dict[str, int]:
    # "table.key" -> line number. tomllib gives no positions, and a mistake without its line is hard to find.
    found: dict[str, int] = {}
    table = ""
    for number, line in enumerate(source.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = header[1].replace('"', "").replace("'", "").replace(" ", "")
            found.setdefault(table, number)
        elif key := _KEY.match(line):
            name = key[1].replace('"', "").replace("'", "")
            found.setdefault(f"{table}.{name}" if table else name, number)
    return found


class _Reader:
    """Collects mistakes while it checks; `where` words a place in the text."""

    def __init__(self, source: str, text: str) -> None:
        self.source = source
        self.lines = _lines(text)
        self.mistakes: list[str] = []

    def refuse(self, path: str, words: str) -> None:
        line = self.lines.get(path) or self.lines.get(path.rpartition(".")[0])
        at = f"{self.source}:{line}" if line else self.source
        self.mistakes.append(f"{at}: {path}: {words}")

    def table(self, path: str, kind: type, given: object) -> Any:
        declared = quantities(kind)
        if not isinstance(given, dict):
            self.refuse(path, f"must be a table, not {given!r}")
            return kind()
        entries = cast(dict[str, object], given)
        values: dict[str, Any] = {}
        for key, value in entries.items():
            if key not in declared:
                self.refuse(f"{path}.{key}", f"unknown key; known here: {', '.join(declared)}")
                continue
            checked = self.value(f"{path}.{key}", declared[key], value)
            if checked is not None:
                values[key] = checked
        return kind(**values)

    def value(self, path: str, quantity: Quantity, value: object) -> Any:
        """The value as its declared type, or None after a refusal."""
        if quantity.choices:
            if isinstance(value, bool) or value not in quantity.choices:
                known = ", ".join(repr(c) for c in quantity.choices)
                self.refuse(path, f"{value!r} is not one of {known}")
                return None
            return value
        if quantity.kind is tuple:
            return self._rows(path, quantity, value)
        if quantity.kind is int and (isinstance(value, bool) or not isinstance(value, int)):
            self.refuse(path, f"{value!r} must be a whole number in {quantity.unit}")
            return None
        return self._number(path, quantity, value)

    def _number(self, path: str, quantity: Quantity, value: object) -> Any:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.refuse(path, f"{value!r} must be a number in {quantity.unit}")
            return None
        if not math.isfinite(value):
            self.refuse(path, f"{value!r} must be a finite number in {quantity.unit}")
            return None
        if not quantity.low <= value <= quantity.high:
            limits = f"{quantity.low:g} .. {quantity.high:g} {quantity.unit}"
            self.refuse(path, f"{value!r} {quantity.unit} is outside {limits}")
            return None
        return quantity.kind(value) if quantity.kind is not tuple else float(value)

    def _rows(self, path: str, quantity: Quantity, value: object) -> Any:
        rows = cast(list[object], value) if isinstance(value, list) else []
        if not 1 <= len(rows) <= 16:
            self.refuse(path, f"must be a list of 1 to 16 rows of {quantity.length} numbers")
            return None
        checked: list[tuple[float, ...]] = []
        for row in rows:
            items = cast(list[object], row) if isinstance(row, list) else []
            if len(items) != quantity.length:
                self.refuse(path, f"{row!r} must be a row of {quantity.length} numbers")
                return None
            numbers = [self._number(path, quantity, item) for item in items]
            if any(n is None for n in numbers):
                return None
            checked.append(tuple(numbers))
        return tuple(checked)


def _effects(reader: _Reader, given: object) -> dict[str, Any]:
    if not isinstance(given, dict):
        reader.refuse("effects", f"must hold tables such as [effects.pulse], not {given!r}")
        return {}
    named = cast(dict[str, object], given)
    for name in named:
        if name not in EFFECTS:
            reader.refuse(f"effects.{name}", f"unknown effect; known: {', '.join(EFFECTS)}")
    return {n: reader.table(f"effects.{n}", EFFECTS[n], named[n]) for n in EFFECTS if n in named}


def parse(text: str, source: str) -> Scene:
    """Read a scene's TOML text; `source` names it in messages. Raises SceneError with every mistake found."""
    try:
        given = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError([f"{source}: not valid TOML: {error}"]) from None
    reader = _Reader(source, text)
    values: dict[str, Any] = {"name": source.rpartition("/")[2].removesuffix(".toml")}
    for key, value in given.items():
        if key in ("name", "words"):
            if not isinstance(value, str) or not 0 < len(value) <= 400 or not value.isprintable():
                reader.refuse(key, f"{value!r} must be one line of text, 1 to 400 characters")
            else:
                values[key] = value
        elif key == "effects":
            values["effects"] = _effects(reader, value)
        elif key in _TABLES:
            values[key] = reader.table(key, _TABLES[key], value)
        else:
            reader.refuse(key, f"unknown key; known here: name, words, effects, {', '.join(_TABLES)}")
    if reader.mistakes:
        raise SceneError(reader.mistakes)
    return Scene(**values)


def as_tables(scene: Scene) -> dict[str, Any]:
    """The scene as plain tables with every default written out: what the `scene` query answers."""
    return dataclasses.asdict(scene)


def from_tables(tables: Mapping[str, Any]) -> Scene:
    """The inverse of `as_tables`, checked like any scene; lists may stand for tuples. Raises SceneError."""
    reader = _Reader("scene", "")
    values: dict[str, Any] = {"name": str(tables.get("name", "")), "words": str(tables.get("words", ""))}
    for key, kind in _TABLES.items():
        values[key] = reader.table(key, kind, _listed(tables.get(key, {})))
    values["effects"] = _effects(reader, tables.get("effects", {}))
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
    return {k: _as_list(v) for k, v in entries.items()}
