"""The store of compiled kernels: never stale, shared by all processes, and never the reason why one does not start.

numba's own cache ignores edits in *other* files, raises on a read-only, full or truncated folder, and lets two
processes that save at the same moment take one file for two signatures: a third would then run the one's code on the
other's memory. Here a module's kernels have a folder that is named by a hash of all that the module imports, a file is
never written twice, whoever compiles locks out the others, and any error means "compile without it". Ordinary Python
threads only.
"""

import functools
import hashlib
import inspect
import os
import re
import shutil
import sys
import tempfile
import time
import uuid
import warnings
from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import UserProvidedCacheLocator
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import NumbaWarning
from numba.core.runtime.nrt import rtsys

from realtime.kernels.store_folder import store_folder

if sys.platform != "win32":
    import fcntl

KERNEL_PACKAGES = ("realtime", "drumstick", "haptic_server", "sound_server")
_KEPT = 4  # folders a module
# Longer than any kernel takes to compile: whoever holds a lock for longer was stopped, and is waited for no more.
_PATIENCE_S = 60.0
_POLL_AGAIN_S = 0.01
# With a newline in front and no other blanks within: a fifth of the time that the same with ^ and \s takes.
_IMPORT = re.compile(
    rb"\n[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+([^\n]*))"
)


@functools.cache
def _roots() -> list[tuple[str, Path]]:
    """Folders of the packages with kernels."""
    found: list[tuple[str, Path]] = []
    for name in KERNEL_PACKAGES:
        spec = find_spec(name)
        folders = spec.submodule_search_locations or [] if spec else []
        found += [(name, Path(folder).resolve()) for folder in folders]
    return found


@functools.cache
def _files() -> dict[str, Path]:
    """The modules of the packages with kernels, and where they lie."""
    found: dict[str, Path] = {}
    for name, root in _roots():
        for folder, _, files in os.walk(root):
            package = ".".join((name, *Path(folder).relative_to(root).parts))
            for file in files:
                if file == "__init__.py":
                    found[package] = Path(folder, file)
                elif file.endswith(".py"):
                    found[f"{package}.{file[:-3]}"] = Path(folder, file)
    return found


@functools.cache
def _source(module: str) -> bytes | None:
    """The text of a module of ours; None when there is none of that name."""
    file = _files().get(module)
    return None if file is None else file.read_bytes()


@functools.cache
def _imports(module: str) -> frozenset[str]:
    """Modules of ours that a module imports, anywhere in its text, each with the packages around it."""
    named: set[str] = set()
    for origin, names, plain in _IMPORT.findall(b"\n" + (_source(module) or b"")):
        named |= {f"{origin.decode()}.{name.decode()}" for name in re.findall(rb"\w+", names)}
        named |= {word.decode() for word in re.findall(rb"[\w.]+", plain)}
    parts = [name.split(".") for name in named]
    around = {".".join(words[:length]) for words in parts for length in range(1, len(words) + 1)}
    return frozenset(
        name for name in around if name.split(".")[0] in KERNEL_PACKAGES and _source(name) is not None
    )


@functools.cache
def _digest(module: str) -> bytes:
    return hashlib.sha256(_source(module) or b"").digest()


@functools.cache
def _hashed(modules: frozenset[str]) -> str:
    digest = hashlib.sha256(f"{sys.version}|{numba.__version__}".encode())
    for module in sorted(modules):
        digest.update(module.encode())
        digest.update(_digest(module))
    return digest.hexdigest()[:16]


@functools.cache
def hash_of(module: str) -> str:
    """A hash of a module of ours, of all of ours that it imports, however far, of Python and of numba."""
    seen, left = {module}, [module]
    while left:
        new = _imports(left.pop()) - seen
        seen |= new
        left += new
    return _hashed(frozenset(seen))


@functools.cache
def hash_of_all() -> str:
    """A hash of every module of the packages with kernels, of Python and of numba."""
    return _hashed(frozenset(_files()))


def _module_at(path: Path) -> str:
    """The name of the module in a file of ours; empty for another's."""
    for name, root in _roots():
        if path.is_relative_to(root):
            inner = path.relative_to(root).with_suffix("").parts
            return ".".join((name, *(inner[:-1] if inner[-1] == "__init__" else inner)))
    return ""


def _open_root() -> Path | None:
    """A writable folder, or None: then everything compiles afresh."""
    root = store_folder()
    try:
        root.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=root):
            pass
    except OSError:
        return None
    return root


def _open_locks() -> int | None:
    # Open for as long as the process lives: closing a file gives up every lock on it.
    if ROOT is None or sys.platform == "win32":
        return None
    try:
        return os.open(ROOT / "locks", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError:
        return None


ROOT = _open_root()
_LOCKS = _open_locks()


def folder_of(module: str) -> Path | None:
    """The folder for what depends on the sources of a module of ours; None where nothing can be kept."""
    if ROOT is None:
        return None
    folder = ROOT / f"{module}-{hash_of(module)}"
    try:
        if folder.is_dir():
            os.utime(folder)  # in use
        else:
            folder.mkdir(exist_ok=True)
            _clear_away(module)
    except OSError:
        return None
    return folder


def _clear_away(module: str) -> None:
    assert ROOT is not None
    newest = sorted(ROOT.glob(f"{module}-*"), key=lambda path: path.stat().st_mtime, reverse=True)
    for stale in newest[_KEPT:]:
        shutil.rmtree(stale, ignore_errors=True)


@functools.cache
def _subpath(py_file: str) -> str:
    module = _module_at(Path(py_file).resolve())
    if not module:  # a test's, a tool's: it may import anything
        return f"{UserProvidedCacheLocator.get_suitable_cache_subpath(py_file)}-{hash_of_all()}"
    folder = folder_of(module)
    return folder.name if folder is not None else f"{module}-{hash_of(module)}"


class Locator(UserProvidedCacheLocator):
    """Names a kernel's folder by its module and the sources, not by where they lie: an installed release, and the next
    one with the same kernels, start with what was compiled before."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """The folder of `py_file`'s kernels, inside the store."""
        return _subpath(py_file)


def _lock(name: str) -> int | None:
    """Take the lock of a name from all other processes; None after a minute, or where there are no locks.

    A lock is a byte of one file, far from all others'. Nothing but the time of a compile depends on having it.
    """
    if _LOCKS is None or sys.platform == "win32":
        return None
    place = int.from_bytes(hashlib.sha256(name.encode()).digest()[:7])
    end = time.monotonic() + _PATIENCE_S
    while time.monotonic() < end:
        try:
            fcntl.lockf(_LOCKS, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
            return place
        except BlockingIOError:
            time.sleep(_POLL_AGAIN_S)
        except OSError:
            return None
    return None


def _unlock(place: int) -> None:
    assert _LOCKS is not None
    assert sys.platform != "win32"
    fcntl.lockf(_LOCKS, fcntl.LOCK_UN, 1, place)


@contextmanager
def exclusive_lock(name: str) -> Generator[None]:
    """Keep other processes out of the blocks with this name, where there are locks."""
    place = _lock(name)
    try:
        yield
    finally:
        if place is not None:
            _unlock(place)


class SharedCache:
    """A dispatcher's cache of compiled functions, in the place of numba's own.

    A kernel that is not stored is compiled by one process, while the others that want it wait for it. A broken entry
    or a full disk means a fresh compile, not an exception.
    """

    def __init__(self, dispatcher: Any) -> None:
        self._dispatcher = dispatcher
        _subpath(
            inspect.getfile(dispatcher.py_func)
        )  # now: when it is wanted, its file may be another version's
        self._name = f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"
        self._held: list[int] = []
        self.wanted: Callable[[Any], bool] = lambda stored: True  # what is stored, but will not do
        dispatcher._cache = self
        dispatcher.compile = self._releasing(dispatcher.compile)

    @functools.cached_property
    def _inner(self) -> Any:
        # Only for a kernel that is wanted: this takes longer than all else about one that is not.
        self._dispatcher.enable_caching()
        inner, self._dispatcher._cache = self._dispatcher._cache, self
        inner._cache_file._data_name = self._unique_name
        return inner

    def _unique_name(self, _number: int) -> str:
        # numba takes the next free number, which two processes may do at once.
        pattern: str = self._inner._cache_file._data_name_pattern
        return pattern.replace("{number:d}", uuid.uuid4().hex)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The stored function, or None when it is now ours to compile. numba calls this."""
        found = self._load(sig, target_context)
        if found is None and (place := _lock(f"{self._name} {sig}")) is not None:
            self._held.append(place)  # until it is compiled
            found = self._load(sig, target_context)
        return found

    def _load(self, sig: Any, target_context: Any) -> Any:
        try:
            # numba (0.68) would first get all ready that a compile needs, which does so itself: a quarter of a start
            # with stored kernels. Of that these need the addresses of numba's own runtime.
            rtsys.initialize(target_context)
            found = self._inner._load_overload(sig, target_context)
            return found if found is None or self.wanted(found) else None
        except Exception:  # noqa: BLE001  unpickling a damaged file can raise anything
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store what was compiled. numba calls this."""
        # Alone, for numba reads the list of what is stored, adds a line and writes it.
        with exclusive_lock(self._name):
            try:
                self._save(sig, data)
            except Exception as error:  # noqa: BLE001  a full disk, a damaged index: the compiled code is good without it
                warnings.warn(f"kernel cache not written: {error}", NumbaWarning, stacklevel=2)

    def _save(self, sig: Any, data: Any) -> None:
        try:
            self._inner.save_overload(sig, data)
        except (ImportError, AttributeError):
            # The list names types by their modules, and another release has those elsewhere: begin a new list.
            self._inner.flush()
            self._inner.save_overload(sig, data)

    def _releasing(self, compile_here: Callable[[Any], Any]) -> Callable[[Any], Any]:
        def compile(sig: Any) -> Any:
            # numba's own lock first: while a thread waits for another process, none compiles what that one may want.
            with global_compiler_lock:
                before = len(self._held)
                try:
                    return compile_here(sig)
                finally:
                    while len(self._held) > before:
                        _unlock(self._held.pop())

        return compile
