"""Commands whose options come in groups: a parameter that is a dataclass stands for all of its fields."""

import dataclasses
import functools
import inspect
from collections.abc import Callable
from typing import Any, get_type_hints


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """`command` as typer sees it: each parameter whose annotation is a dataclass replaced by its fields, in its place.

    Fields of the dataclass keep their annotations and defaults, which must all be there. TypeError for a name that
    comes twice.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, type] = {}
    flat: dict[str, inspect.Parameter] = {}

    def add(name: str, kind: Any, default: Any) -> None:
        if name in flat:
            raise TypeError(f"{command.__name__}: --{name.replace('_', '-')} comes twice")
        flat[name] = inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)

    for name, parameter in inspect.signature(command).parameters.items():
        kind = hints[name]
        if dataclasses.is_dataclass(kind) and isinstance(kind, type):
            groups[name] = kind
            own = get_type_hints(kind, include_extras=True)
            for field in dataclasses.fields(kind):
                add(field.name, own[field.name], field.default)
        else:
            add(name, kind, parameter.default)

    @functools.wraps(command)
    def called(**given: Any) -> None:
        made = {
            name: kind(**{field.name: given.pop(field.name) for field in dataclasses.fields(kind)})
            for name, kind in groups.items()
        }
        command(**made, **given)

    called.__signature__ = inspect.Signature(list(flat.values()))  # pyright: ignore[reportAttributeAccessIssue]
    called.__annotations__ = {name: parameter.annotation for name, parameter in flat.items()}
    del called.__wrapped__
    return called
