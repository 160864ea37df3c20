"""The parameter table: what can be set live in a scene, by wire name.

It is assembled from the declarations, never typed here.
`z_h0` is the one derived entry: where the hand holds its spring, another view of z_ss = z_h0 - m g*/K_hand.
Setting it moves z_ss; raising k_hand leaves z_ss where it is. Control threads only; allocates.
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from drumstick.parameters.declare import Quantity, live_quantities
from drumstick.parameters.pickups import pickups_off_head, with_pickups_at
from drumstick.parameters.scene import Scene, require_scene
from drumstick.scenes import stick_tables
from drumstick.stick.effects.registry import in_order
from drumstick.stick.law import DRUM, Records, law_of, live_in_drum

Z_H0 = "z_h0"


class Refusal(ValueError):
    """Reason why a set of values was not accepted: what, where, limit, unit, what to do."""


@dataclass(frozen=True)
class Parameter:
    """One row: wire name, its declaration, and the effect it belongs to (None: the stick; "drum": heard, not felt).

    place: of a value of the drum, among those that can be set live there.
    """

    name: str
    quantity: Quantity
    effect: str | None
    place: int = 0

    @property
    def field(self) -> str | int:
        """The field of the law's record that holds the value, or the place in the drum's part of it."""
        return self.place if self.effect == DRUM else self.name.rpartition(".")[2]

    def part_of(self, record: Any) -> Any:
        """The stick's or the effect's part of the law's record."""
        return record if self.effect is None else record[self.effect]

    def norm(self, value: float) -> float:
        """Map a value to 0..1 over the declared range, linearly or by logarithm as the declaration says."""
        low, high = self.quantity.low, self.quantity.high
        if self.quantity.scale == "log":
            return math.log(value / low) / math.log(high / low)
        return (value - low) / (high - low)

    def from_norm(self, norm: float) -> float:
        """The inverse of `norm`."""
        low, high = self.quantity.low, self.quantity.high
        if self.quantity.scale == "log":
            return min(max(low * (high / low) ** norm, low), high)
        return low + (high - low) * norm

    def check(self, value: float) -> float:
        """The value as float; raises Refusal when it is not finite or outside the declared range."""
        q = self.quantity
        unit = "" if q.unit == "1" else f" {q.unit}"
        if not math.isfinite(value):
            raise Refusal(
                f"{self.name}: {value!r} is not a finite number; send {q.low:g} .. {q.high:g}{unit}"
            )
        if not q.low <= value <= q.high:
            raise Refusal(f"{self.name}: {value:g}{unit} is outside {q.low:g} .. {q.high:g}{unit}")
        return float(value) + 0.0  # -0.0 is 0


_Z_H0 = Parameter(Z_H0, stick_tables.Z_H0, None)


def table_of(scene: Scene) -> dict[str, Parameter]:
    """Wire name -> row, for what the scene contains; stick first, then its effects, then z_h0, then the drum."""
    rows: dict[str, Parameter] = {}
    owners: list[tuple[str | None, object]] = [
        (None, scene.stick),
        *((name, scene.effects[name]) for name in in_order(scene.effects)),
    ]
    for effect, table in owners:
        for quantity in live_quantities(table).values():
            if quantity.wire is not None:
                # Both pulses have a tau: the second one's is called by its effect.
                name = quantity.wire if quantity.wire not in rows else f"{effect}.{quantity.wire}"
                rows[name] = Parameter(name, quantity, effect)
    rows[Z_H0] = _Z_H0
    for place, (name, (quantity, _)) in enumerate(live_in_drum(scene).items()):
        rows[name] = Parameter(name, quantity, DRUM, place)
    return rows


def _sag(record: Any) -> float:
    """Distance by which gravity pulls the stick below z_h0, m; k_hand must be above 0."""
    return float(record["m"] * record["g_star_m_per_s2"] / record["k_hand"])


def values_of(law: Records, table: Mapping[str, Parameter]) -> dict[str, float]:
    """Every parameter's value in `law`, shape (1,). z_h0 is NaN while the hand has no stiffness."""
    record = law[0]
    values: dict[str, float] = {}
    for name, row in table.items():
        if name == Z_H0:
            sag = _sag(record) if record["k_hand"] > 0.0 else math.nan
            values[name] = float(record["z_ss"] + sag)
        else:
            values[name] = float(row.part_of(record)[row.field])
    return values


def with_changes(law: Records, table: Mapping[str, Parameter], changes: Mapping[str, float]) -> Records:
    """A copy of `law` with these values, each within its own range. Raises Refusal; leaves `law` alone."""
    changed = law.copy()
    record = changed[0]
    for name, value in changes.items():
        row = table.get(name)
        if row is None:
            raise Refusal(f"{name}: no such parameter in this scene; it has {', '.join(table)}")
        checked = row.check(value)
        if name != Z_H0:
            row.part_of(record)[row.field] = checked
    if Z_H0 in changes:
        if "z_ss" in changes:
            raise Refusal("z_h0 and z_ss are two views of one value: send only one of them")
        if not record["k_hand"] > 0.0:
            raise Refusal("z_h0: has no meaning while k_hand is 0 N/m; set k_hand first, or z_ss")
        z_ss = changes[Z_H0] - _sag(record)
        record["z_ss"] = table["z_ss"].check(float(z_ss))
    return changed


def scene_values(scene: Scene) -> dict[str, float]:
    """Values that can be changed while the scene plays, by wire name, in SI units.

    The stick's first, then its effects', z_h0 (m; where the hand holds its spring; NaN while it has no stiffness), the
    drum's. docs/scenes.md says what each is, its unit and its range.

    >>> import drumstick as ds
    >>> ds.values(ds.scene("roll"))["k_hand"]
    20.0
    """
    require_scene(scene)
    return values_of(law_of(scene), table_of(scene))


def scene_with(scene: Scene, changes: Mapping[str, float]) -> Scene:
    """The scene with these values by wire name, each within its own range. Raises Refusal."""
    if not changes:
        return scene
    rows = table_of(scene)
    changed = values_of(with_changes(law_of(scene), rows, changes), rows)
    names = {"z_ss" if name == Z_H0 else name for name in changes}

    def renewed(table: object, effect: str | None) -> Any:
        keys = {
            key: changed[name]
            for key, quantity in live_quantities(table).items()
            for name in names
            if rows[name].quantity.wire == quantity.wire and rows[name].effect == effect
        }
        return dataclasses.replace(cast(Any, table), **keys)

    drum = {name: renewed(table, DRUM) for name, table in scene.drum.effects.items()}
    listen = with_pickups_at(renewed(scene.listen, DRUM), changed)
    for words in pickups_off_head(listen):
        raise Refusal(words)
    return dataclasses.replace(
        scene,
        stick=renewed(scene.stick, None),
        effects={name: renewed(table, name) for name, table in scene.effects.items()},
        drum=dataclasses.replace(renewed(scene.drum, DRUM), effects=drum),
        mallet=None if scene.mallet is None else renewed(scene.mallet, DRUM),
        listen=listen,
    )
