"""One kernel made of many parts: the function of one name of every part that a record names, folded into one.

A part is a module, e.g. an effect of the stick, and has only the functions that it needs. Which parts take part follows
from the record's type, at compile time: one that the record does not name costs nothing, neither then nor later.
"""

import functools
import inspect
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any, TypeVar, cast

from realtime.kernels.jit import ArgumentType, has_part, overload

F = TypeVar("F", bound=Callable[..., Any])
# From the parts' calls, as text, to the body of the function that makes them all.
Fold = Callable[[list[str]], str]


def each(calls: list[str]) -> str:
    """One after another; nothing comes back."""
    return "\n    ".join(calls)


def added(calls: list[str]) -> str:
    """The sum, in the order of the parts; tuples are joined."""
    return f"return {' + '.join(calls)}"


def sizes_added(calls: list[str]) -> str:
    """The sum of the absolute values."""
    return added([f"abs({call})" for call in calls])


def multiplied(calls: list[str]) -> str:
    """The product."""
    return f"return {' * '.join(calls)}"


def least(calls: list[str]) -> str:
    """The smallest."""
    return f"return {functools.reduce(lambda a, b: f'min({a}, {b})', calls)}"


def largest(calls: list[str]) -> str:
    """The largest."""
    return f"return {functools.reduce(lambda a, b: f'max({a}, {b})', calls)}"


def any_of(calls: list[str]) -> str:
    """True if one says so; the parts after it are not asked."""
    return f"return {' or '.join(calls)}"


def all_of(calls: list[str]) -> str:
    """True if all say so; the parts after one that does not are not asked."""
    return f"return {' and '.join(calls)}"


def present(calls: list[str]) -> str:
    """True: there is one; none is called."""
    return "return True"


def single(calls: list[str]) -> str:
    """The one that there is; TypeError for more."""
    if len(calls) > 1:
        raise TypeError(f"only one part may have this: {', '.join(calls)}")
    return f"return {calls[0]}"


def listed(calls: list[str]) -> str:
    """A tuple, one item a part."""
    return f"return ({', '.join(calls)},)"


def _calls(found: Mapping[str, Callable[..., Any]], given: list[str], own: Mapping[str, str]) -> list[str]:
    # Each function gets, by name, those of the arguments that it asks for, and its own items of others.
    calls: list[str] = []
    taken = dict.fromkeys(own, 0)
    for name, function in found.items():
        arguments: list[str] = []
        for asked in inspect.signature(function).parameters:
            if asked in own:
                arguments.append(f"{own[asked]}[{taken[asked]}]")
                taken[asked] += 1
            elif asked in given:
                arguments.append(asked)
            else:
                where = f"{function.__module__}.{function.__name__}"
                raise TypeError(f"{where} asks for `{asked}`; there are: {', '.join((*given, *own))}")
        calls.append(f"{name}({', '.join(arguments)})")
    return calls


def folded(
    parts: Mapping[str, ModuleType], fold: Fold, *, hook: str = "", own: Mapping[str, str] | None = None
) -> Callable[[F], F]:
    """Make the decorated function call `hook` (its own name) of each of `parts` that its first argument names.

    parts: by the name of the record's field, in the order of the fold. The decorated body is what remains when the
    record names none that has the function. own: an argument of the parts' functions -> the tuple that holds one item
    for each part that asks for it. TypeError while compiling if a part's function asks for what there is not.
    """

    def decorate(neutral: F) -> F:
        name = hook or neutral.__name__
        signature = inspect.signature(neutral)
        given = list(signature.parameters)

        def choose(record: ArgumentType, *_: ArgumentType) -> Callable[..., Any]:
            found = {
                f"{part}_{name}": getattr(module, name)
                for part, module in parts.items()
                if hasattr(module, name) and has_part(record, part)
            }
            if not found:
                return neutral
            namespace: dict[str, Any] = dict(found)
            body = fold(_calls(found, given, own or {}))
            exec(f"def folded({', '.join(given)}):\n    {body}\n", namespace)
            whole: Callable[..., Any] = namespace["folded"]
            # Its symbol in the stored code is made from these: another for other parts.
            whole.__module__ = neutral.__module__
            whole.__name__ = neutral.__name__
            whole.__qualname__ = f"{neutral.__qualname__}.{fold.__name__}.{'.'.join(found)}"
            return whole

        def placeholder(*_: Any) -> Any:
            raise TypeError(f"{neutral.__module__}.{neutral.__name__} is for compiled code")

        plain = signature.replace(
            parameters=[p.replace(annotation=inspect.Parameter.empty) for p in signature.parameters.values()],
            return_annotation=inspect.Signature.empty,
        )
        for function in (choose, placeholder):
            functools.update_wrapper(function, neutral)
            function.__signature__ = plain
        overload(placeholder)(choose)
        return cast(F, placeholder)

    return decorate
