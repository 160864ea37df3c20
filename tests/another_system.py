"""`drumstick` as if on Windows or macOS: without the modules and names of Python that they lack. A process of its own.

    python another_system.py SYSTEM '[["doctor"], ["up"]]'     # prints a JSON list of exit statuses and outputs

It finds what ours would miss, not what a package would; numba goes on compiling for Linux, since it fills the store.
"""

import contextlib
import ctypes
import importlib
import io
import json
import os
import pkgutil
import signal
import socket
import sys
from typing import Any

OURS = ("drumstick", "haptic_server", "protocol", "realtime", "rig", "sound_server")
LINUX_MODULES = ("fcntl", "grp", "pwd", "resource", "termios")  # and macOS
UNIX_NAMES = {
    os: ("getuid", "geteuid", "set_blocking", "setsid", "O_CLOEXEC", "O_NONBLOCK", "O_NOCTTY"),
    signal: ("SIGHUP", "SIGKILL", "pthread_sigmask"),
    socket: ("AF_UNIX",),
}
LINUX_NAMES = {
    os: ("posix_fallocate", *(name for name in dir(os) if name.lower().startswith("sched_"))),
    socket: ("SOCK_CLOEXEC", "TCP_DEFER_ACCEPT"),
}


class _Library(ctypes.CDLL):
    def __init__(self, name: str | None, *rest: Any, **named: Any) -> None:
        if name is None:
            raise TypeError("bad argument type for built-in operation")  # Windows' words
        super().__init__(name, *rest, **named)


class _Elsewhere:
    # Module sys, on another platform.
    def __init__(self, system: str) -> None:
        self.platform = system

    def __getattr__(self, name: str) -> Any:
        return getattr(sys, name)


def load_ours() -> None:
    """Import all modules of ours but those that cannot be; a command that needs one of these fails."""
    for package in map(importlib.import_module, OURS):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}.", onerror=lambda _: None):
            with contextlib.suppress(ImportError, AttributeError, OSError):  # OSError: no PortAudio
                importlib.import_module(found.name)


def ours() -> list[str]:
    return [name for name in sys.modules if name.partition(".")[0] in OURS]


def take_away(names: dict[Any, tuple[str, ...]]) -> None:
    for module, lacking in names.items():
        for name in lacking:
            delattr(module, name)


def become(system: str) -> None:
    """Take away what `system` lacks, and let ours, nobody else, know themselves there."""
    load_ours()  # and packages of others with them, which then stay as they are
    for name in ours():
        del sys.modules[name]
    take_away(LINUX_NAMES)
    if system == "win32":
        take_away(UNIX_NAMES)
        sys.modules.update(dict.fromkeys(LINUX_MODULES))  # importing one is an ImportError
        for name in ("CDLL", "WinDLL"):
            setattr(ctypes, name, _Library)
    linux, sys.platform = sys.platform, system
    load_ours()
    sys.platform = linux
    for module in [vars(sys.modules[name]) for name in ours()]:
        if module.get("sys") is sys:
            module["sys"] = _Elsewhere(system)


def ran(words: list[str]) -> tuple[int, str]:
    """Exit status and output of one command."""
    from rig.cli.command import main

    sys.argv = ["drumstick", *words]
    output = io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        try:
            main()
        except SystemExit as end:
            return int(end.code or 0), output.getvalue()
    return 0, output.getvalue()


if __name__ == "__main__":
    become(sys.argv[1])
    print(json.dumps([ran(words) for words in json.loads(sys.argv[2])]))
