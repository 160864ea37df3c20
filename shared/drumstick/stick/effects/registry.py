"""The effects of the stick, in the order in which they are summed, which is part of the contract.

A new effect is one module of this folder and one line here. The module has

- `TABLE`, the dataclass of `[effects.<name>]`: the scene's keys, the wire, the panel and the docs follow from it;
- `LAW`, its parameters for the kernels, and `STATE`, what it keeps between ticks: fields of a record;
- `STRENGTH`, the wire name of the parameter that makes it stronger: the one to lower when a set goes too far;
- if so, `NEVER_REPEATS` (a roll with it has no return map: chance, or a memory from contact to contact) and
  `ALTERS_HEAD` (it changes the head's spring or damper, so that equation (7) has nothing to say), and `ALSO_NEEDED`
  (words: what `usable` asks for besides numbers in their ranges);
- `usable(law)`, which every effect must have, and those of the functions named in `drumstick.stick.composition` that it
  needs, decorated with `only_with`. Each asks by name for the arguments it needs.

An effect that an installed package gives (`own_effect`) is adopted when a scene names it: after those here, by name.

`drumstick.safety.all_effects` makes upper bounds of `usable` and the `max_...` ones. An effect that adds force, speed
or stiffness must have the one that says how much, or a device would be let in that it can overcome.
"""

from collections.abc import Collection, Mapping
from types import ModuleType
from typing import Any

from drumstick import packages
from drumstick.stick.effects import (
    chaos,
    cor_pulse,
    hysteretic_spring,
    negative_damping,
    noise,
    pulse,
    system_delay,
)
from drumstick.stick.effects.own_effect import Effect

_IN_ORDER: tuple[ModuleType, ...] = (
    pulse,
    cor_pulse,
    system_delay,
    hysteretic_spring,
    negative_damping,
    noise,
    chaos,
)
EFFECTS: dict[str, ModuleType] = {module.__name__.rpartition(".")[2]: module for module in _IN_ORDER}

# `[effects.<name>]`.
STICK_TABLES: dict[str, type] = {name: module.TABLE for name, module in EFFECTS.items()}


def adopt(name: str, effect: Effect, module: str) -> None:
    """Add an effect, defined in `module`, that is none of ours. ValueError where it cannot bear that name."""
    if EFFECTS.get(name) in _IN_ORDER:
        raise ValueError(f"{name} is an effect of the instrument itself: choose another name")
    EFFECTS[name] = effect.part_of(name, module)
    STICK_TABLES[name] = effect.table
    for other in sorted(name for name, part in EFFECTS.items() if part not in _IN_ORDER):
        EFFECTS[other], STICK_TABLES[other] = EFFECTS.pop(other), STICK_TABLES.pop(other)


def find(name: str) -> None:
    """Adopt the effect of this name from an installed package if it is unknown. PackageError where that is broken."""
    if name not in EFFECTS and (found := packages.load(packages.EFFECTS, name, Effect)) is not None:
        try:
            adopt(name, *found)
        except ValueError as error:
            raise packages.PackageError(
                f"the installed package of {found[1]} cannot be used: {error}"
            ) from error


def has_no_bound(name: str) -> bool:
    """True for an effect of another package that does not say how large its force can be: no device plays it."""
    own: Effect | None = getattr(EFFECTS[name], "OWN", None)
    return own is not None and own.max_force is None


def in_order(names: Collection[str]) -> tuple[str, ...]:
    """These effects as the records have them, whatever the order in which a scene names them.

    Of another order the same effects would be another type of record, and all kernels compiled again.
    """
    return tuple(name for name in EFFECTS if name in names)


def mean_lag_s(tables: Mapping[str, Any]) -> float:
    """Mean age of the head's force, s, by these effects alone: what their tables tell of it."""
    return sum((getattr(table, "mean_lag_s", 0.0) for table in tables.values()), start=0.0)


def names_with(mark: str) -> tuple[str, ...]:
    """Names of the effects that have `mark`, a function or NEVER_REPEATS or ALTERS_HEAD, in order."""
    return tuple(name for name, module in EFFECTS.items() if hasattr(module, mark))


def strength_of(name: str) -> str:
    """The field of the law's record that makes this effect stronger."""
    return EFFECTS[name].STRENGTH.rpartition(".")[2]
