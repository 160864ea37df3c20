"""A scene as TOML, every value written out. No comments, and no keys that only stand for others (`z_h0_m`)."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, cast

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables


def _value(value: object) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # TOML's strings in double quotes are JSON's
    if isinstance(value, Sequence):
        return f"[{', '.join(map(_value, cast(Sequence[object], value)))}]"
    return repr(value)


def _table(path: str, table: Mapping[str, Any]) -> Iterator[str]:
    yield f"\n[{path}]"
    yield from (
        f"{key} = {_value(value)}" for key, value in table.items() if not isinstance(value, dict | None)
    )
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _table(f"{path}.{key}", cast(dict[str, Any], value))


def as_toml(scene: Scene) -> str:
    """Text that `scene_text.parse` reads as an equal scene."""
    absent = ("words" if not scene.words else "", "mesh" if scene.modal is not None else "")
    tables = {
        key: value for key, value in as_tables(scene).items() if value is not None and key not in absent
    }
    lines = [f"{key} = {_value(tables.pop(key))}" for key in ("name", "words") if key in tables]
    for name, table in tables.items():
        lines += _table(name, table)
    return "\n".join(lines) + "\n"
