"""A machine that lacks what a rig needs: one line that names it, before anything starts."""

import errno
import socket
import subprocess
import sys
from types import SimpleNamespace

import pytest

from rig.exit_status import LACKING, CommandError
from rig.machine import machine_needs


class _Deaf(socket.socket):
    def sendto(self, *_: object) -> int:  # type: ignore[override]
        raise OSError(errno.ENETUNREACH, "Network is unreachable")


_LOOK = """
import resource, sys
from rig.machine import machine_needs
from rig.exit_status import CommandError
{limit}
try:
    machine_needs.require_machine()
except CommandError as stop:
    print(stop)
    sys.exit(stop.status)
print(resource.getrlimit(resource.RLIMIT_NOFILE)[0])
"""


def _looked(limit: str, *before: str) -> subprocess.CompletedProcess[str]:
    command = [*before, sys.executable, "-c", _LOOK.format(limit=limit)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_an_ordinary_machine_has_all() -> None:
    assert _looked("").returncode == 0


def test_a_soft_limit_of_files_is_raised() -> None:
    found = _looked("resource.setrlimit(resource.RLIMIT_NOFILE, (24, 1024))")
    assert (found.returncode, found.stdout.strip()) == (0, "256")


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        (
            "resource.setrlimit(resource.RLIMIT_NOFILE, (24, 24))",
            "24 files open here, a rig needs 256: ulimit -n",
        ),
        (
            "resource.setrlimit(resource.RLIMIT_AS, (3 << 29, 3 << 29))",
            "1.5 GiB of addresses here, a rig needs 2: ulimit -v",
        ),
    ],
)
def test_a_limit_that_is_too_low_is_named(limit: str, words: str) -> None:
    found = _looked(limit)
    assert found.returncode == LACKING
    assert words in found.stdout


def test_without_loopback_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_needs, "socket", SimpleNamespace(**{**vars(socket), "socket": _Deaf}))
    with pytest.raises(CommandError, match="ip link set lo up") as stop:
        machine_needs.require_machine()
    assert stop.value.status == LACKING
