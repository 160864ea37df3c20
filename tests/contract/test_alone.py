"""The suite is alone with itself (alone.py): what plays on this machine, or a second suite, never meets it."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from alone import be_alone

TESTS = Path(__file__).resolve().parents[1]

# As a rig that plays here: it holds the port that programs have by default, and its run folder exists.
_LOOK = f"""
import os, socket, sys
sys.path.insert(0, {str(TESTS)!r})
from alone import be_alone
done = be_alone(os.environ)
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
    try:
        port.bind(("127.0.0.1", int(sys.argv[1])))
        print("free")
    except OSError:
        print("taken")
print(*sorted(os.listdir("/dev/shm")), sep=",")
print(os.environ["XDG_RUNTIME_DIR"])
done()
"""

# Draws while the others live, as workers of one suite do.
_DRAW = f"""
import sys
sys.path.insert(0, {str(TESTS)!r})
from ports import free_port
print(*(free_port() for _ in range(500)))
input()
"""


def _look(port: int) -> list[str]:
    environment = {name: value for name, value in os.environ.items() if name != "DRUMSTICK_SUITE_IS_ALONE"}
    command = [sys.executable, "-c", _LOOK, str(port)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()


def test_a_second_suite_has_folders_of_its_own() -> None:
    first, second = _look(0)[-1], _look(0)[-1]
    assert len({first, second, os.environ["XDG_RUNTIME_DIR"]}) == 3


@pytest.mark.skipif(os.environ.get("DRUMSTICK_SUITE_IS_ALONE") != "namespaces", reason="needs root on Linux")
def test_as_root_it_meets_no_port_and_no_memory_of_others() -> None:
    assert {name for _, name in socket.if_nameindex()} == {"lo"}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rig:
        rig.bind(("127.0.0.1", 0))
        free, listed, _ = _look(rig.getsockname()[1])
    assert free == "free"
    assert all(name.startswith("drumstick-suite-") for name in listed.split(","))


def test_a_worker_stays_where_the_suite_is() -> None:
    environment = {"DRUMSTICK_SUITE_IS_ALONE": "folders"}
    be_alone(environment)()
    assert environment == {"DRUMSTICK_SUITE_IS_ALONE": "folders"}


def test_tests_that_run_side_by_side_draw_no_port_twice() -> None:
    command = [sys.executable, "-c", _DRAW]
    beside = [
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for _ in range(3)
    ]
    try:
        drawn = [
            port for each in beside if each.stdout is not None for port in each.stdout.readline().split()
        ]
    finally:
        for each in beside:
            each.communicate("\n")
    assert len(set(drawn)) == len(drawn) == 1500
