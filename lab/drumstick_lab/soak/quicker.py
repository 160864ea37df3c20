"""A scene whose stick strikes N times as often and is otherwise the same: mass, length and time divided by N.

Scaled by 1/N, each of the three, equations (1) to (4) stay what they are: speeds (m/s), forces (N) and dampings (N s/m)
keep their values, stiffnesses (N/m) grow by N, and so the coefficient of restitution, the cycle's speeds and the peak
forces are those of the scene, N times as often. It is still the device, the law and the servo that make the strikes.
"""

import json
import re
import tomllib
from collections.abc import Mapping
from typing import Any, cast

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables, parse
from rig.exit_status import usage_error

MOST = 100.0
# Of each unit that ends a key: how often mass, length and time stand in it, together.
_POWERS = {
    "kg": 1,
    "m": 1,
    "s": 1,
    "m_per_s": 0,
    "m_per_s2": -1,
    "N": 0,
    "N_per_m": -1,
    "N_s_per_m": 0,
    "Hz": -1,
}
_UNIT = re.compile(r"_(kg|m|s|m_per_s|m_per_s2|N|N_per_m|N_s_per_m|Hz)$")
_UNCHANGED = (
    "g_star_m_per_s2",
)  # z_ss holds what gravity does; g* only translates it to a height of the hand


def quicker(text: str, source: str, speed: float) -> str:
    """The text of the scene with its stick and effects scaled to strike `speed` times as often. Raises CommandError.

    Drum, sound, servo and guard stay what they are. A sampled arm is refused: its hand and its ticks do not
    scale; and a hand that follows a file.
    """
    if speed == 1.0:
        return text
    scene = parse(text, source)
    if scene.device.plant != "stick":
        usage_error(
            f'--speed {speed:g}: the scene {scene.name!r} plays a sampled arm ([device] plant = "phantom"), whose ticks'
            ' cannot be made quicker: use --speed 1, or a scene with the plant "stick"'
        )
    if scene.hand_moves_stick:
        usage_error(
            f"--speed {speed:g}: the hand of {scene.name!r} moves by {scene.hand.gesture_file}, which cannot be made"
            " quicker: use --speed 1, or another scene"
        )
    if "geometry" in _of(tomllib.loads(text), "stick"):
        usage_error(f"--speed {speed:g}: the scene {scene.name!r} gives a geometry; give its m_kg instead")
    tables = tomllib.loads(text)
    whole = as_tables(scene)  # with the defaults, which must be scaled too
    tables["stick"] = _scaled(whole["stick"], speed)
    if scene.effects:
        tables["effects"] = {name: _scaled(whole["effects"][name], speed) for name in scene.effects}
    if scene.drum.effects:
        tables["drum"]["effects"] = whole["drum"]["effects"]  # by the names that they have now
    made = _toml(tables)
    _check(made, source, speed)
    return made


def _of(tables: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    return cast(Mapping[str, Any], tables.get(name, {}))


def _scaled(table: Mapping[str, Any], speed: float) -> dict[str, Any]:
    scaled = dict(table)
    for key, value in table.items():
        unit = _UNIT.search(key)
        if unit and key not in _UNCHANGED and isinstance(value, int | float):
            scaled[key] = float(value) * speed ** -_POWERS[unit[1]]
    return scaled


def _check(text: str, source: str, speed: float) -> Scene:
    from drumstick.scenes.scene_text import SceneError

    try:
        return parse(text, f"{source} at --speed {speed:g}")
    except SceneError as error:
        usage_error(f"--speed {speed:g} takes this scene out of its ranges: {error.mistakes[0]}")


def _toml(tables: Mapping[str, Any], path: str = "") -> str:
    # What scenes are made of: numbers, texts, truths, lists of these, tables.
    plain = {key: value for key, value in tables.items() if not isinstance(value, dict)}
    lines = [f"[{path}]"] if path else []
    lines += [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in plain.items()]
    for key, value in tables.items():
        if isinstance(value, dict):
            lines += ["", _toml(cast(Mapping[str, Any], value), f"{path}.{key}" if path else key)]
    return "\n".join(lines)
