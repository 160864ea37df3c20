"""The suite alone with itself: no port, folder, rig or shared memory that another rig or suite here could meet.

As root on Linux it moves into a network with nothing but loopback, and has a /dev/shm of its own: ports that programs
have by default are free there, multicast reaches nobody else, and JACK's registry, which remembers eight servers of a
machine for ever, begins empty. For anybody else free ports (ports.py) and folders of the suite's own must do.
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, MutableMapping
from pathlib import Path

_IS_ALONE = "DRUMSTICK_SUITE_IS_ALONE"  # what workers inherit
_SHM = Path("/dev/shm")
_NEW_MOUNTS, _NEW_IPC, _NEW_NETWORK = 0x00020000, 0x08000000, 0x40000000
_FOLDERS = ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_RUNTIME_DIR", "XDG_STATE_HOME")


def _moved_away() -> bool:
    # By the process itself: a program around it would be forgotten by whoever types `pytest`.
    if not (sys.platform == "linux" and os.geteuid() == 0 and shutil.which("ip") and shutil.which("mount")):
        return False
    if ctypes.CDLL(None, use_errno=True).unshare(_NEW_MOUNTS | _NEW_IPC | _NEW_NETWORK) != 0:
        return False  # a container without the right to
    for command in (
        "mount --make-rprivate /",
        f"mount -t tmpfs -o mode=1777 tmpfs {_SHM}",
        "ip link set dev lo multicast on up",
        "ip route add 224.0.0.0/4 dev lo",
        # An address of the machine that is not 127.0.0.1, by which it would speak to strangers: what must listen on
        # loopback only is tried there too.
        "ip address add 198.18.0.1/32 dev lo",
        "ip route add 192.0.2.0/24 dev lo src 198.18.0.1",
    ):
        # There is no way back: a suite that went on would be red for a network that is down.
        done = subprocess.run(command.split(), capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(
                f"in namespaces of its own, the suite cannot {command!r}: {done.stderr.strip()}"
            )
    return True


def be_alone(environment: MutableMapping[str, str]) -> Callable[[], None]:
    """Move there with all that starts from now on; what must be done at the end. Before any thread is started."""
    if _IS_ALONE in environment:
        return lambda: None
    environment[_IS_ALONE] = "namespaces" if _moved_away() else "folders"
    # In memory, as on a machine that plays: a servo must not wait for a disk.
    folder = Path(tempfile.mkdtemp(prefix="drumstick-suite-", dir=_SHM if os.access(_SHM, os.W_OK) else None))
    for variable in _FOLDERS:
        (folder / variable).mkdir(mode=0o700)
        environment[variable] = str(folder / variable)
    return lambda: shutil.rmtree(folder, ignore_errors=True)
