"""The effects of the stick, in the order in which they are summed, which is part of the contract.

A new effect is one module of this folder and one line here. The module has

- `TABLE`, the dataclass of `[effects.<name>]`: the scene's keys, the wire, the panel and the docs follow from it;
- `LAW`, its parameters for the kernels, and `STATE`, what it keeps between ticks: fields of a record;
- `STRENGTH`, the wire name of the parameter that makes it stronger: the one to lower when a set goes too far;
- if so, `NEVER_REPEATS` (a roll with it has no return map: chance, or a memory from contact to contact) and
  `ALTERS_HEAD` (it changes the head's spring or damper, so that equation (7) has nothing to say);
- `usable(law)`, which every effect must have, and those of the functions named in `drumstick.stick.composition` that it
  needs, decorated with `only_with`. Each asks by name for the arguments it needs.

`drumstick.safety.all_effects` makes upper bounds of `usable` and the `max_...` ones. An effect that adds force, speed
or stiffness must have the one that says how much, or a device would be let in that it can overcome.
"""

from collections.abc import Collection, Mapping
from types import ModuleType
from typing import Any

from drumstick.stick.effects import (
    chaos,
    cor_pulse,
    hysteretic_spring,
    negative_damping,
    noise,
    pulse,
    system_delay,
)

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
