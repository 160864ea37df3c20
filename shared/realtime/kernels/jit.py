"""The only access to numba's decorators, typed. Call them at import time only, from ordinary Python threads.

numba itself comes with the first kernel that is called (`compiler`): who only reads what is declared beside kernels, a
scene's tables, does without half a second and 80 MB. Until then what a decorator gives stands for what it will be.
"""

import functools
import importlib
import inspect
import sys
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar, cast

if TYPE_CHECKING:
    # The loop of a `parallel` kernel; everywhere else it is `range`.
    prange: Any

F = TypeVar("F", bound=Callable[..., Any])
# What the function under `overload` gets: the numba type of an argument, at compile time.
ArgumentType = Any

_LOADING = threading.RLock()
_put_off: list[Callable[[], object]] = []


def _compiler() -> Any:
    """numba with our options; what was put off is done first, in its order."""
    with _LOADING:
        from realtime.kernels import compiler

        waiting, _put_off[:] = _put_off[:], []
        for work in waiting:
            work()
        return compiler


def _when_loaded(work: Callable[[], object]) -> None:
    if "numba" in sys.modules:
        _compiler()
        work()
    else:
        _put_off.append(work)


class _Deferred:
    """Stand-in for what is made when numba is loaded; numba asks it for its type."""

    def __init__(self, make: Callable[[], Any], like: Callable[..., Any] | None) -> None:
        self._make, self._made = make, None
        if like is not None:
            functools.update_wrapper(self, like)
        _put_off.append(self._now)

    def _now(self) -> Any:
        with _LOADING:
            if self._made is None:
                _compiler()
            if self._made is None:  # not among what was put off, or asked for while that is done
                self._made = self._make()
            return self._made

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        made = self._made
        return (self._now() if made is None else made)(*arguments, **named)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # who only looks at a module asks for such
            raise AttributeError(name)
        return getattr(self._now(), name)

    def __reduce__(self) -> Any:
        return self._now().__reduce__()

    @property
    def _numba_type_(self) -> Any:
        return _compiler().type_of(self._now())


def deferred(make: Callable[[], Any], like: Callable[..., Any] | None = None) -> Any:
    """Result of `make`, for compiled code to name: made at once where numba is loaded already, else with it."""
    if "numba" in sys.modules:
        _compiler()
        return make()
    return _Deferred(make, like)


def __getattr__(name: str) -> Any:
    if name == "prange":
        return _compiler().numba.prange
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def leave_out_blas() -> None:
    """Spare a service scipy's linear algebra, which numba imports before the first kernel only to know whether it is
    there: a third of the time that loading one takes. No kernel of ours multiplies matrices."""
    scipys = "scipy.linalg.cython_blas"
    if scipys not in sys.modules:
        sys.modules[scipys] = None  # ty: ignore[invalid-assignment]  Python's own way to say that there is none
        importlib.import_module("numba.np.arraymath")
        del sys.modules[scipys]


def njit(
    *, fastmath: bool | set[str] = False, inline: bool = False, parallel: bool = False
) -> Callable[[F], F]:
    """Compile for the real-time threads: no GIL, no ZeroDivisionError (IEEE results), cached.

    `fastmath` is for the drum only, and there not for the mesh's sweep: that and the stick's kernels keep the order of
    summation as part of their contract. `parallel` lets the turns of a `prange` loop share the cores: sweeps
    only, one caller at a time.
    """

    def decorate(function: F) -> F:
        return cast(F, deferred(lambda: _compiler().kernel(function, fastmath, inline, parallel), function))

    return decorate


def overload(function: Callable[..., Any]) -> Callable[[F], F]:
    """Give `function` a compiled body chosen from the argument *types* (here: a scene's record type)."""

    def decorate(chooser: F) -> F:
        _when_loaded(lambda: _compiler().register_overload(function, chooser))
        return chooser

    return decorate


def record_has(law: Any, field: str) -> bool:
    """Compile-time test: does the scene's record type name this effect?"""
    return field in law.fields


def has_part(kind: ArgumentType, part: str) -> bool:
    """Compile-time test: has a record this part, or a named tuple (and it is there), itself or among its `effects`?"""
    if not hasattr(kind, "types"):
        return record_has(kind, part)
    if part in kind.fields:
        return not is_none(kind, part)
    return "effects" in kind.fields and has_part(kind.types[kind.fields.index("effects")], part)


def is_none(named: ArgumentType, field: str) -> bool:
    """Compile-time test: is this field of a named tuple None, or nothing?"""
    from numba.core import types

    kind = named.types[named.fields.index(field)]
    return isinstance(kind, types.NoneType) or kind == types.Tuple(())


def array_has(named: ArgumentType, array: str, field: str) -> bool:
    """Compile-time test: have the records of this array, a field of a named tuple, such a field?"""
    return field in named.types[named.fields.index(array)].dtype.fields


def _constant(value: Any, arguments: int, name: str) -> Callable[..., Any]:
    # numba wants the very number of arguments, and folds the constant away. Its symbol is made from the name, which
    # must therefore be another for another constant.
    of_arity: dict[int, Callable[..., Any]] = {
        1: lambda a: value,
        2: lambda a, b: value,
        3: lambda a, b, c: value,
        4: lambda a, b, c, d: value,
    }
    constant = of_arity[arguments]
    constant.__qualname__ = name
    return constant


def only_with(effect: str, otherwise: float | bool | tuple[float, ...] | None = None) -> Callable[[F], F]:
    """Compile the decorated body where its first argument names `effect`: a law's record, or a drum's named tuple.

    A scene that does not name it gets none of its code, only the constant `otherwise`: the choice is made from
    the type, at compile time.
    """

    def decorate(body: F) -> F:
        own = inspect.signature(body)
        absent = _constant(otherwise, len(own.parameters), f"{body.__module__}.{body.__name__}.absent")

        def choose(law: ArgumentType, *_: ArgumentType) -> Callable[..., Any]:
            return body if has_part(law, effect) else absent

        def placeholder(*_: Any) -> Any:
            raise TypeError(f"{body.__module__}.{body.__name__} is for compiled code")

        plain = own.replace(
            parameters=[p.replace(annotation=inspect.Parameter.empty) for p in own.parameters.values()],
            return_annotation=inspect.Signature.empty,
        )
        for function in (choose, placeholder):
            functools.update_wrapper(function, body)
            function.__signature__ = plain
        overload(placeholder)(choose)
        return placeholder

    return decorate


class CFunction:
    """A compiled C callback: `address` may be called by foreign threads without the GIL."""

    def __init__(self, function: Callable[..., Any], signature: Any, cache: bool = True) -> None:
        """`signature`: in numba's words, or one of numba's own."""
        self._cfunc = _compiler().c_function(function, signature, cache)

    @property
    def address(self) -> int:
        """The C function's address, valid while this object lives."""
        return int(self._cfunc.address)

    @property
    def was_stored(self) -> bool:
        """True when it came from the store instead of being compiled."""
        return bool(self._cfunc.cache_hits)


def cfunction(signature: str, *, cache: bool = True) -> Callable[[Callable[..., Any]], CFunction]:
    """Compile a C callback, e.g. `@cfunction("int32(voidptr, voidptr, uint64)")`.

    `cache=False` for a closure: it would never be found in the cache again, only make it grow.
    """

    def decorate(function: Callable[..., Any]) -> CFunction:
        return CFunction(function, signature, cache)

    return decorate


def allocations() -> int:
    """Number of arrays the compiled code has allocated so far: the proof of "no allocation in the tick"."""
    from numba.core.runtime import _nrt_python, rtsys

    if not _nrt_python.memsys_stats_enabled():
        _nrt_python.memsys_enable_stats()
    return int(rtsys.get_allocation_stats().alloc)
