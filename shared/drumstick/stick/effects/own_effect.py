"""An effect of the stick that another package gives: a force of the head, and how large it can be.

`Effect` is what its author writes; `part_of` makes of it what a module of this folder has, for `registry`. Kernels:
tick thread; no allocation.
"""

import dataclasses
import keyword
import math
from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Any, NamedTuple

from drumstick.parameters.declare import Quantity, quantities
from drumstick.stick.effects.triggers import ON_ENTRY
from drumstick.stick.records import Law, Motion, field_of
from realtime.kernels.foreign_parts import (
    call_of,
    inner,
    part_function,
    record_of,
    require_arguments,
    source_of,
)
from realtime.records import Record, fields_of

SHORTEST_HOLD_S = 1e-4
_DUE_S = 1e-15  # what rounding may leave of a time that is over
_MAX_N = 1e6
# What each function of an effect may ask for.
_MOTION = ("own", "state", "motion")
_ARGUMENTS = {"force": _MOTION, "fire": (*_MOTION, "when"), "renew": _MOTION, "max_force": ("own",)}
_USABLE = "{low!r} <= law.{name}.{field} <= {high!r}"


class _Seen(NamedTuple):
    # What an effect is told of the stick.
    z: float
    v: float
    v_in: float


@dataclass(frozen=True)
class Effect:
    """An effect of the stick of one's own: a force of the head on the stick while they touch (docs/extend.md).

    table: the dataclass of `[effects.NAME]`; its numbers are made by `ds.number`, those with a `wire` name can be set
    live. state: what it keeps, a `ds.Record`, 0 at first. All else are plain functions in Python's own text that are
    compiled into the tick: no allocation, no exceptions, no Python objects. Each asks by name for what it needs: `own`,
    the table's numbers by the last word of their wire names; `state`; `motion`, the stick's (`z` m, `v` m/s, `v_in` of
    this contact); `when`.

    force: N, up is positive. It must not change between two calls of `fire` or `renew`: the exact motion is solved in
    closed form over all of that time. fire: told `when` something happens: 0 entry, 1 the first deepest point, 2 exit,
    3 up again, 4 down again. renew: called at entry and every `every_s` s in the head. max_force: the largest force, N,
    whatever happens. The envelope reckons with it, and `force` is cut to it; without it no device plays the effect.
    strength: the wire name of the value that makes it stronger, the lowest of which is no effect at all; the first one
    if not given. ValueError for what cannot be one.

    >>> from dataclasses import dataclass
    >>> import drumstick as ds
    >>> @dataclass(frozen=True)
    ... class Sticky:
    ...     force_N: float = ds.number(0.2, 0.0, 5.0, "N", "How strongly it holds", wire="sticky.force")
    >>> ds.Effect(Sticky, force=lambda own: -own.force, max_force=lambda own: own.force).strength
    'sticky.force'
    """

    table: type
    force: Callable[..., float]
    max_force: Callable[..., float] | None = None
    fire: Callable[..., None] | None = None
    renew: Callable[..., None] | None = None
    every_s: float = 0.001
    state: type[Record] = Record
    strength: str = ""

    def __post_init__(self) -> None:
        if not dataclasses.is_dataclass(self.table):
            raise ValueError("table: give a dataclass with numbers made by ds.number")
        declared = quantities(self.table)
        for field in dataclasses.fields(self.table):
            quantity = declared.get(field.name)
            if quantity is None or quantity.choices or quantity.kind not in (float, int):
                raise ValueError(f"{field.name}: give a number made by ds.number")
        wires = [quantity.wire for quantity in declared.values() if quantity.wire]
        if not wires or self.strength not in ("", *wires):
            raise ValueError("strength: one number must have a wire name, to make the effect weaker by")
        object.__setattr__(self, "strength", self.strength or wires[0])
        for what, known in _ARGUMENTS.items():
            function = getattr(self, what)
            if function is not None:
                require_arguments(function, what, known)
        if not self.every_s >= SHORTEST_HOLD_S:
            raise ValueError(f"every_s = {self.every_s!r} s: give {SHORTEST_HOLD_S} s or more")

    def part_of(self, name: str, module: str) -> ModuleType:
        """Part for the registry of an effect of that name, defined in `module`. ValueError where the name cannot be."""
        _require_name(name, self.table)
        functions = [getattr(self, what) for what in _ARGUMENTS]
        source = source_of(module, [function for function in functions if function is not None])
        part = ModuleType(f"{module}.{name}")
        declared = {field_of(key, quantity): quantity for key, quantity in quantities(self.table).items()}
        kinds: dict[str, Any] = {field: quantity.kind for field, quantity in declared.items()}
        timed: dict[str, Any] = {"until_renewal_s": float} if self.renew is not None else {}
        for attribute, found in {
            "TABLE": self.table,
            "LAW": record_of("OwnLaw", kinds, Record, source),
            "STATE": record_of("OwnState", timed, self.state, source),
            "STRENGTH": self.strength,
            "ALTERS_HEAD": True,
            "OWN": self,
            **self._functions(name, declared),
        }.items():
            setattr(part, attribute, found)
        if fields_of(self.state) or self.renew is not None:
            vars(part)["NEVER_REPEATS"] = True  # for all that is known
        return part

    def _functions(self, name: str, declared: dict[str, Quantity]) -> dict[str, Callable[..., Any]]:
        # Copies, which cannot be written to: what the envelope has judged, and where the stick is, are not an effect's.
        given = {"state": f"motion.{name}", "when": "when"}
        given["own"] = f"Own({', '.join(f'law.{name}.{field}' for field in declared)})"
        given["motion"] = "Seen(motion.z, motion.v, motion.v_in)"
        names: dict[str, Any] = {
            "Own": namedtuple("Own", declared),  # pyright: ignore[reportUntypedNamedTuple]
            "Seen": _Seen,
            "inf": math.inf,
            "every_s": self.every_s,
            "shortest": _DUE_S,
            "entry": ON_ENTRY,
        }

        def made(text: str, hook: Callable[..., Any] | None = None, **more: Any) -> Callable[..., Any]:
            own = {} if hook is None else {"hook": inner(hook)}
            call = "" if hook is None else call_of(hook, given)
            return part_function(text.format(n=name, call=call), name, names | own | more)

        # Written so that NaN fails each comparison: a bound that is none refuses, a force that is none faults.
        bound = (
            made("def max_force(law):\n    return inf")
            if self.max_force is None
            else made(
                "def max_force(law):\n    most = {call}\n    return most if most >= 0.0 else inf",
                self.max_force,
            )
        )
        usable = " and ".join(
            _USABLE.format(low=q.low, high=q.high, name=name, field=field) for field, q in declared.items()
        )
        found = {
            "max_force": bound,
            "asked_force": made("def asked_force(law, motion):\n    return {call}", self.force),
            "force": made(
                "def force(law, motion):\n    most, asked = bound(law), {call}\n"
                "    return most if asked > most else -most if asked < -most else asked",
                self.force,
                bound=bound,
            ),
            "usable": made(f"def usable(law):\n    return {usable}"),
            "can_add_energy": made("def can_add_energy(law):\n    return bound(law) > 0.0", bound=bound),
            "can_move_resting_stick": made(
                "def can_move_resting_stick(law):\n    return bound(law) > 0.0", bound=bound
            ),
        }
        if self.fire is not None:
            found["fire"] = made("def fire(law, motion, when):\n    {call}", self.fire)
        if self.renew is not None:
            found |= self._timed(made, found.get("fire"))
        return found

    def _timed(
        self, made: Callable[..., Any], fire: Callable[..., Any] | None
    ) -> dict[str, Callable[..., Any]]:
        renewed = "{call}\n        motion.{n}.until_renewal_s = every_s"
        fired = "    inner_fire(law, motion, when)\n" if fire is not None else ""
        return {
            "fire": made(
                f"def fire(law, motion, when):\n{fired}    if when == entry:\n        {renewed}",
                self.renew,
                inner_fire=fire,
            ),
            "renew": made(
                "def renew(law, motion, in_head):\n"
                f"    if in_head and motion.{{n}}.until_renewal_s <= shortest:\n        {renewed}",
                self.renew,
            ),
            "due_in": made(
                "def due_in(law, motion, in_head):\n    return motion.{n}.until_renewal_s if in_head else inf"
            ),
            "elapse": made("def elapse(law, motion, duration):\n    motion.{n}.until_renewal_s -= duration"),
            "varies_at_rest": made("def varies_at_rest(law):\n    return True"),
        }


def _require_name(name: str, table: type) -> None:
    taken = {field for record in (Law, Motion) for field, *_ in fields_of(record)}
    if not name.isidentifier() or name in {*taken, "drum", "places_of"} or keyword.iskeyword(name):
        raise ValueError(f"{name} cannot be the name of an effect")
    fields = set[str]()
    for key, quantity in quantities(table).items():
        if quantity.wire is not None and quantity.wire.rpartition(".")[0] != name:
            raise ValueError(f'wire = "{quantity.wire}" must begin with the name of the effect: {name}.word')
        if field_of(key, quantity) in fields:
            raise ValueError(f"two numbers are called {field_of(key, quantity)}")
        fields.add(field_of(key, quantity))
