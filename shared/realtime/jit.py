"""The one door to numba's decorators: typed, with a compile cache that cannot go stale or stop a process.

numba's own cache ignores edits in *other* files and raises on a read-only, full or truncated cache folder.
Here the folder is named by a hash of every kernel source and of numba's version, and any cache error means
"compile without it". Call the decorators at import time only, from ordinary Python threads.
"""

import functools
import hashlib
import inspect
import os
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy.typing as npt
from numba.core.caching import UserProvidedCacheLocator
from numba.core.errors import NumbaWarning

KERNEL_PACKAGES = ("realtime", "drumstick", "haptic_server", "sound_server")
_KEPT_CACHES = 4

# The loop of a `parallel` kernel; everywhere else it is `range`.
prange: Any = numba.prange

F = TypeVar("F", bound=Callable[..., Any])
# A numpy record as compiled code sees it: fields are read and written as attributes. Any, because numba
# infers it.
Record = Any
# An array of such records, shape (n,), as compiled code sees it: slots[i] is a Record.
Records = npt.NDArray[Any]
# What the function under `overload` gets: the numba type of an argument, at compile time.
ArgumentType = Any


@functools.cache
def _roots() -> list[tuple[str, Path]]:
    """Where the packages with kernels lie."""
    found: list[tuple[str, Path]] = []
    for name in KERNEL_PACKAGES:
        spec = find_spec(name)
        folders = spec.submodule_search_locations or [] if spec else []
        found += [(name, Path(folder).resolve()) for folder in folders]
    return found


def _source_hash() -> str:
    digest = hashlib.sha256(f"{sys.version}|{metadata.version('numba')}".encode())
    for _, root in _roots():
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_root() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(base) / "haptic-drumstick"


def _open_cache() -> Path | None:
    """A writable folder for this exact set of sources, or None: then everything compiles afresh."""
    root = _cache_root()
    folder = root / f"kernels-{_source_hash()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        os.utime(folder)
        old = sorted(root.glob("kernels-*"), key=lambda p: p.stat().st_mtime, reverse=True)
        for stale in old[_KEPT_CACHES:]:
            shutil.rmtree(stale, ignore_errors=True)
    except OSError:
        return None
    return folder


# Without the wrapper for passing a kernel as a value, which nothing does: a fifth of the time of a cold compile.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def _name_records_by_content() -> None:
    # numba names a record type, in the symbols of what it compiles, by a counter of this process. Two processes that
    # compile for different scenes use the same names; a third that loads both from the cache would call the kernels of
    # the one with the memory of the other (numba 0.68, types.Record.mangling_args).
    def mangling_args(self: Any) -> tuple[str, tuple[str]]:
        return "Record", ("r" + hashlib.sha256(self.name.encode()).hexdigest()[:24],)

    numba.types.Record.mangling_args = property(mangling_args)


class Locator(UserProvidedCacheLocator):
    """Names a kernel's folder by its package, not by where that lies: an installed release, and the next one with the
    same kernels, start with what was compiled before. The cache folder's hash vouches for the sources."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """The folder of `py_file`'s kernels, inside the cache folder."""
        folder = Path(py_file).resolve().parent
        for name, root in _roots():
            if folder.is_relative_to(root):
                return ".".join((name, *folder.relative_to(root).parts))
        return super().get_suitable_cache_subpath(py_file)


_name_records_by_content()
CACHE_FOLDER = _open_cache()
if CACHE_FOLDER is not None:
    numba.config.CACHE_DIR = str(CACHE_FOLDER)
    numba.config.CACHE_LOCATOR_CLASSES = f"{__name__}.{Locator.__name__}"


class _ForgivingCache:
    """numba's function cache, where a broken entry or a full disk means a fresh compile, not an exception."""

    def __init__(self, inner: Any) -> None:
        self._inner = inner

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return self._inner.load_overload(sig, target_context)
        except Exception:  # noqa: BLE001  unpickling a damaged file can raise anything
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            self._inner.save_overload(sig, data)
        except Exception as error:  # noqa: BLE001  a full disk, a damaged index: the compiled code is good without it
            warnings.warn(f"kernel cache not written: {error}", NumbaWarning, stacklevel=2)


def njit(
    *, fastmath: bool | set[str] = False, inline: bool = False, parallel: bool = False
) -> Callable[[F], F]:
    """Compile for the real-time threads: no GIL, no ZeroDivisionError (IEEE results), cached.

    `fastmath` is for the mesh only; the stick's kernels keep the order of summation as part of their
    contract. `parallel` lets the turns of a `prange` loop share the cores: sweeps only, one caller at a time.
    """

    def decorate(function: F) -> F:
        options: dict[str, Any] = dict(_OPTIONS, fastmath=fastmath)
        if parallel:
            options["parallel"] = True
        if inline:
            options["forceinline"] = True
        dispatcher = numba.njit(**options)(function)
        if CACHE_FOLDER is not None:
            dispatcher.enable_caching()
            dispatcher._cache = _ForgivingCache(dispatcher._cache)
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
    """At compile time: does the scene's record type name this effect?"""
    return field in law.fields


def _names(kind: ArgumentType, field: str) -> bool:
    # Does a record type have this field, or a named tuple something else than None there?
    return record_has(kind, field) and not (hasattr(kind, "types") and is_none(kind, field))


def is_none(named: ArgumentType, field: str) -> bool:
    """At compile time: is this field of a named tuple None?"""
    from numba.core import types

    return isinstance(named.types[named.fields.index(field)], types.NoneType)


def array_has(named: ArgumentType, array: str, field: str) -> bool:
    """At compile time: have the records of this array, a field of a named tuple, such a field?"""
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
            return body if _names(law, effect) else absent

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

    def __init__(self, function: Callable[..., Any], signature: str, cache: bool = True) -> None:
        options = {"error_model": "numpy"}
        if cache and CACHE_FOLDER is not None:
            try:
                self._cfunc = numba.cfunc(signature, nopython=True, cache=True, **options)(function)
                return
            except Exception as error:  # noqa: BLE001  a damaged file can raise anything; a real mistake raises again below
                warnings.warn(f"kernel cache not used: {error}", NumbaWarning, stacklevel=2)
        self._cfunc = numba.cfunc(signature, nopython=True, **options)(function)

    @property
    def address(self) -> int:
        """The C function's address, valid while this object lives."""
        return int(self._cfunc.address)


def cfunction(signature: str, *, cache: bool = True) -> Callable[[Callable[..., Any]], CFunction]:
    """Compile a C callback, e.g. `@cfunction("int32(voidptr, voidptr, uint64)")`.

    `cache=False` for a closure: it would never be found in the cache again, only make it grow.
    """

    def decorate(function: Callable[..., Any]) -> CFunction:
        return CFunction(function, signature, cache)

    return decorate


def allocations() -> int:
    """How many arrays the compiled code has allocated so far: the proof of "no allocation in the tick"."""
    from numba.core.runtime import _nrt_python, rtsys

    if not _nrt_python.memsys_stats_enabled():
        _nrt_python.memsys_enable_stats()
    return int(rtsys.get_allocation_stats().alloc)
