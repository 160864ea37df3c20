"""`[stick]` as it may be written: m directly or by `[stick.geometry]`, z_ss directly or by z_h0."""

import math
from collections.abc import Mapping
from typing import Any, cast

from drumstick.parameters.declare import Quantity, quantities
from drumstick.parameters.stick import Geometry, Stick
from drumstick.scenes.reading import Reader

_SHORTEST_ARM_M = 0.01
_HIGHEST_DAMPING_RATIO = 0.9999  # beta by (3) is 1e-97 there
Z_H0 = Quantity(
    float, -1.0, 1.0, "m", "Where the hand holds its spring: lower makes a faster roll",
    symbol="z_h0", equation="z_ss = z_h0 - m g*/K_hand",
)  # fmt: skip


def _geometry(reader: Reader, given: object) -> Geometry | None:
    path = "stick.geometry"
    values = reader.values(path, Geometry, given)
    entries = cast(dict[str, object], given) if isinstance(given, dict) else {}
    missing = [key for key in quantities(Geometry) if key not in entries]
    if missing:
        reader.refuse(path, f"needs all of {', '.join(quantities(Geometry))}; missing: {', '.join(missing)}")
    if len(values) < len(quantities(Geometry)):
        return None
    geometry = Geometry(**values)
    if abs(geometry.arm_m) < _SHORTEST_ARM_M:
        reader.refuse(
            path, f"tip_m and grip_m must be at least {_SHORTEST_ARM_M:g} m apart, not {geometry.arm_m:g} m"
        )
        return None
    return geometry


def _derived(reader: Reader, path: str, key: str, value: float) -> dict[str, float]:
    quantity = quantities(Stick)[key]
    if quantity.low <= value <= quantity.high:
        return {key: value}
    limits = f"{quantity.low:g} .. {quantity.high:g} {quantity.unit}"
    reader.refuse(path, f"gives {key} = {value:g} {quantity.unit}, outside {limits}")
    return {}


def _from_geometry(reader: Reader, entries: dict[str, object]) -> dict[str, float]:
    for key in ("m_kg", "g_star_m_per_s2"):
        if key in entries:
            reader.refuse(f"stick.{key}", "follows from [stick.geometry]: give one of the two")
    geometry = _geometry(reader, entries["geometry"])
    if geometry is None:
        return {}
    mass = _derived(reader, "stick.geometry", "m_kg", geometry.m_kg)
    return mass | _derived(reader, "stick.geometry", "g_star_m_per_s2", geometry.g_star_m_per_s2)


def _rest(reader: Reader, entries: dict[str, object], stick: Stick) -> dict[str, float]:
    if "z_ss_m" in entries:
        reader.refuse("stick.z_h0_m", "z_h0_m and z_ss_m are two views of one value: give one of the two")
        return {}
    z_h0 = reader.value("stick.z_h0_m", Z_H0, entries["z_h0_m"])
    if z_h0 is None:
        return {}
    if not stick.k_hand_N_per_m > 0.0:
        reader.refuse("stick.z_h0_m", "has no meaning while k_hand_N_per_m is 0 N/m: give z_ss_m")
        return {}
    z_ss = z_h0 - stick.m_kg * stick.g_star_m_per_s2 / stick.k_hand_N_per_m
    return _derived(reader, "stick.z_h0_m", "z_ss_m", z_ss)


def stick_of(reader: Reader, given: object) -> Stick:
    """The table as a Stick whose m, g* and z_ss are numbers, however they were given."""
    values: dict[str, Any] = reader.values("stick", Stick, given, also_known=("z_h0_m", "geometry"))
    entries = cast(dict[str, object], given) if isinstance(given, dict) else {}
    if "geometry" in entries:
        values |= _from_geometry(reader, entries)
    if "z_h0_m" in entries:
        values |= _rest(reader, entries, Stick(**values))
    return Stick(**values)


def check_scale(reader: Reader, stick: Stick, effects: Mapping[str, Any]) -> None:
    """Check what only stick and effects together can get wrong: a division by a beta that (3) does not have."""
    added = effects.get("cor_pulse")
    if added is not None and added.scale == "speed_over_beta":
        # Not by the kernel of (3): what reads a file compiles nothing.
        highest = _HIGHEST_DAMPING_RATIO * 2.0 * math.sqrt(stick.m_kg * stick.k_coll_N_per_m)
        if not stick.r_in_N_s_per_m <= highest:
            reader.refuse(
                "effects.cor_pulse.scale",
                f"equation (3) has no beta at r_in_N_s_per_m = {stick.r_in_N_s_per_m:g}: let it be at most "
                f'{highest:.4g} (2 sqrt(m_kg k_coll_N_per_m)), or set scale = "speed"',
            )
