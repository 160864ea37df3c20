"""Preconditions of a rig, checked before anything starts: open files, memory, a loopback network. Control thread.

Without them services would hang or be started again for ever, each for a reason of its own; here is one clear line.
"""

import socket
import sys

from rig.exit_status import unavailable

if sys.platform != "win32":
    import resource

FILES = 256  # of one process: some thirty of its own, and one for each that connects
MEMORY_BYTES = 2 << 30  # of addresses, not of memory in use: the gateway takes up 1.6 GiB
_PATIENCE_S = 2.0


def require_machine() -> None:
    """Raises CommandError with status 3 when one of them is missing. Raises the soft limit of open files where it
    may."""
    _require_files()
    _require_addresses()
    _require_loopback()


def _require_files() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or soft >= FILES:
        return
    if hard != resource.RLIM_INFINITY and hard < FILES:
        unavailable(
            f"a process may have {hard} files open here, a rig needs {FILES}: ulimit -n, or LimitNOFILE= of a service"
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (FILES, hard))


def _require_addresses() -> None:
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    if soft != resource.RLIM_INFINITY and soft < MEMORY_BYTES:
        unavailable(
            f"a process may have {soft / 2**30:.1f} GiB of addresses here, a rig needs {MEMORY_BYTES >> 30}: ulimit -v,"
            " or LimitAS= of a service"
        )


def _require_loopback() -> None:
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
            own.settimeout(_PATIENCE_S)
            own.bind(("127.0.0.1", 0))
            own.sendto(b"?", own.getsockname())
            own.recv(1)
    except OSError as error:
        unavailable(
            f"nothing that is sent to 127.0.0.1 arrives ({error}): switch loopback on, ip link set lo up"
        )
