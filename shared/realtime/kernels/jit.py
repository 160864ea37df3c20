"""The only access to numba's decorators: typed, with options of their own and `store` in place of numba's.

Call the decorators at import time only, from ordinary Python threads.
"""

import functools
import hashlib
import importlib
import inspect
import sys
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba.core.errors import NumbaWarning

from realtime.kernels import inner_kernels, inner_libraries, store

# The loop of a `parallel` kernel; everywhere else it is `range`.
prange: Any = numba.prange

F = TypeVar("F", bound=Callable[..., Any])
# What the function under `overload` gets: the numba type of an argument, at compile time.
ArgumentType = Any


# Without the wrapper for passing a kernel as a value, which nothing does: a fifth of the time of a cold compile. And
# not forced into its callers. That must be said: else numba forces it there, with all that it calls in turn, when it is
# first compiled for a kernel that is itself forced.
_OPTIONS: dict[str, Any] = {
    "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "forceinline": False,
}  # fmt: skip


def _name_records_by_content() -> None:
    # numba names a record type, in the symbols of what it compiles, by a counter of this process. Two processes that
    # compile for different scenes use the same names; a third that loads both from the cache would call the kernels of
    # the one with the memory of the other (numba 0.68, types.Record.mangling_args).
    def mangling_args(self: Any) -> tuple[str, tuple[str]]:
        return "Record", ("r" + hashlib.sha256(self.name.encode()).hexdigest()[:24],)

    numba.types.Record.mangling_args = property(mangling_args)


_name_records_by_content()
inner_libraries.install()
if store.ROOT is not None:
    numba.config.CACHE_DIR = str(store.ROOT)
    numba.config.CACHE_LOCATOR_CLASSES = f"{store.__name__}.{store.Locator.__name__}"


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
        options: dict[str, Any] = dict(_OPTIONS, fastmath=fastmath, forceinline=inline)
        if parallel:
            options["parallel"] = True
        dispatcher = numba.njit(**options)(function)
        if store.ROOT is not None:
            store.SharedCache(dispatcher)
        inner_kernels.wrap_when_called(dispatcher)
        return dispatcher

    return decorate


def overload(function: Callable[..., Any]) -> Callable[[F], F]:
    """Give `function` a compiled body chosen from the argument *types* (here: a scene's record type)."""
    from numba.extending import overload as numba_overload

    options = dict(_OPTIONS, no_cpython_wrapper=True)  # never called from Python
    register = numba_overload(function, jit_options=options, inline="never", strict=False)

    def decorate(chooser: F) -> F:
        return register(chooser)

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
        options = {"error_model": "numpy"}
        if cache and store.ROOT is not None:
            try:
                with store.exclusive_lock(f"{function.__module__}.{function.__qualname__}"):
                    self._cfunc = numba.cfunc(signature, nopython=True, cache=True, **options)(function)
                return
            except Exception as error:  # noqa: BLE001  a damaged file can raise anything; a real mistake raises again below
                warnings.warn(f"kernel cache not used: {error}", NumbaWarning, stacklevel=2)
        self._cfunc = numba.cfunc(signature, nopython=True, **options)(function)

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
