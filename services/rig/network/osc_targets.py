"""OSC targets of the rigs that play on this machine: two that send alike to one port cannot be told apart there."""

import logging
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO

import msgspec

from realtime.log import say
from rig import folder
from rig.exit_status import unavailable

if sys.platform != "win32":
    import fcntl

FILE = "osc.json"  # in a run folder: what its rig sends where; locked while that rig plays
REMEDY = (
    "a program there cannot tell the two apart: start one of them with --osc-out HOST:PORT or --prefix /NAME"
)


class Sender(msgspec.Struct, frozen=True):
    """A rig that sends OSC: its targets, host:port each, and the prefix of its addresses."""

    rig: str
    targets: tuple[str, ...]
    prefix: str

    def shared_with(self, other: "Sender") -> list[str]:
        """Targets to which both send with the same prefix, in this rig's words."""
        theirs = {_numeric(target) for target in other.targets}
        same = self.prefix == other.prefix
        return [target for target in self.targets if same and _numeric(target) in theirs]


def _numeric(target: str) -> str:
    # Nobody is asked for the addresses of names here: a start does not wait for a network.
    host, _, port = target.lower().rpartition(":")
    return f"{'127.0.0.1' if host == 'localhost' else host}:{port.lstrip('0')}"


def publish(run: Path, own: Sender) -> IO[bytes]:
    """Write what this rig sends into its run folder; others count it as playing while the returned file is open.

    Raises CommandError when the folder is full or read-only.
    """
    assert sys.platform != "win32"
    path = run / FILE
    temporary = path.with_name(f".{FILE}.{os.getpid()}")
    try:
        file = temporary.open("wb")
        fcntl.flock(file, fcntl.LOCK_EX)  # before others can see it
        file.write(msgspec.json.encode(own))
        file.flush()
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        unavailable(f"{path} cannot be written: {error.strerror}")
    return file


def playing() -> list[Sender]:
    """This user's rigs that play on this machine now, by name; only those with this one's XDG_RUNTIME_DIR."""
    found = (_read(run / FILE) for run in folder.run_folders())
    return sorted((sender for sender in found if sender is not None), key=lambda sender: sender.rig)


def _read(path: Path) -> Sender | None:
    assert sys.platform != "win32"
    try:
        with path.open("rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return msgspec.json.decode(file.read(), type=Sender)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.MsgspecError) as error:  # of another version perhaps: no reason not to play
        say(
            logging.WARNING,
            f"drumstick: {path} cannot be read ({error}): where that rig sends OSC is not known",
        )
    return None


def collisions(own: Sender, others: Iterable[Sender]) -> Iterator[str]:
    """Words for each other rig that sends to a target of `own` with the same prefix."""
    for other in others:
        if other.rig != own.rig and (shared := own.shared_with(other)):
            yield f"rig {other.rig!r} sends OSC to {', '.join(shared)} too, with the same prefix {own.prefix}"


def publish_and_warn(run: Path, own: Sender) -> IO[bytes]:
    """`publish`, then a warning for each rig that sends alike. Of two that start at once, one at least warns."""
    file = publish(run, own)
    warn(own)
    return file


def warn(own: Sender) -> None:
    """Warn of each rig of another name that plays here and sends alike."""
    for words in collisions(own, playing()):
        say(logging.WARNING, f"drumstick: {words}; {REMEDY}")
