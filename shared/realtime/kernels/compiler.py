"""numba as `jit` uses it: options of our own, and `store` in place of its cache. Loaded with the first kernel that is
called; ordinary Python threads only.
"""

import hashlib
import warnings
from collections.abc import Callable
from typing import Any

import numba
from numba.core.errors import NumbaWarning
from numba.core.registry import cpu_target
from numba.extending import overload as numba_overload

from realtime.kernels import inner_kernels, inner_libraries, store

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


def kernel(function: Callable[..., Any], fastmath: bool | set[str], inline: bool, parallel: bool) -> Any:
    """numba's dispatcher of a function, which finds what is stored of it."""
    options: dict[str, Any] = dict(_OPTIONS, fastmath=fastmath, forceinline=inline)
    if parallel:
        options["parallel"] = True
    dispatcher = numba.njit(**options)(function)
    if store.ROOT is not None:
        store.SharedCache(dispatcher)
    inner_kernels.wrap_when_called(dispatcher)
    return dispatcher


def register_overload(function: Callable[..., Any], chooser: Callable[..., Any]) -> None:
    """Let numba ask `chooser` for the body of `function`."""
    options = dict(_OPTIONS, no_cpython_wrapper=True)  # never called from Python
    numba_overload(function, jit_options=options, inline="never", strict=False)(chooser)


def c_function(function: Callable[..., Any], signature: Any, cache: bool) -> Any:
    """numba's C callback of a function."""
    options = {"error_model": "numpy"}
    if cache and store.ROOT is not None:
        try:
            with store.exclusive_lock(f"{function.__module__}.{function.__qualname__}"):
                return numba.cfunc(signature, nopython=True, cache=True, **options)(function)
        except Exception as error:  # noqa: BLE001  a damaged file can raise anything; a real mistake raises again below
            warnings.warn(f"kernel cache not used: {error}", NumbaWarning, stacklevel=3)
    return numba.cfunc(signature, nopython=True, **options)(function)


def type_of(made: Any) -> Any:
    """numba's type of a kernel or of what kernels call, as it finds one by its name."""
    return cpu_target.typing_context.resolve_value_type(made)
