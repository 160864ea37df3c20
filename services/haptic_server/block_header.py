"""The header of the block, the same in every version and for every scene: whether a servo is held outlives it here.

Header and control cells; servo, gateway and supervisor, control threads. The tick uses the cells by their numbers.
"""

import mmap
import os
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from haptic_server.files import BLOCK
from realtime.atomics import add_to, peek

STOP, PANIC, ARM, HEARTBEAT, HELD, PANICS_SEEN = 0, 8, 16, 24, 32, 40  # one cache line each
HEADER_CELLS, CONTROL_CELLS = 8, 48
MAGIC = 0x6B63697473  # "stick"
MAGIC_CELL, SIGNATURE_CELL, BOOT_CELL, PID_CELL = 0, 1, 2, 3
INVALID_SIGNATURE = 0  # no signature is 0
STALE_NS = 100_000_000
_BYTES = 8 * (HEADER_CELLS + CONTROL_CELLS)

Cells = npt.NDArray[np.int64]


class BlockError(OSError):
    """The file is not a block of this scene and version."""


class BlockHeader(NamedTuple):
    """Views into the mapped file, shapes (8,) and (48,)."""

    header: Cells
    control: Cells

    @property
    def boot(self) -> int:
        """Identifies the servo's start."""
        return int(self.header[BOOT_CELL])

    @property
    def pid(self) -> int:
        """Process id of the servo."""
        return int(self.header[PID_CELL])


def read_header(folder: Path) -> BlockHeader | None:
    """Header of the block in place; None when there is none. BlockError when what lies there has no such front."""
    path = folder / BLOCK
    try:
        with path.open("r+b") as file:
            if os.fstat(file.fileno()).st_size < _BYTES:
                raise BlockError(f"{path}: too short for a block")
            memory = mmap.mmap(file.fileno(), _BYTES)
    except FileNotFoundError:
        return None
    except BlockError:
        raise
    except OSError as error:  # a folder, a file of somebody else's
        raise BlockError(f"{path}: cannot be opened: {error.strerror}") from error
    header = np.frombuffer(memory, np.int64, HEADER_CELLS)
    if int(header[MAGIC_CELL]) != MAGIC:
        raise BlockError(f"{path}: no block")
    return BlockHeader(header, np.frombuffer(memory, np.int64, CONTROL_CELLS, header.nbytes))


def is_alive(control: Cells) -> bool:
    """True when the servo ticked within the last tenth of a second."""
    return time.monotonic_ns() - peek(control, HEARTBEAT) < STALE_NS


def is_about_to_tick(mapped: BlockHeader) -> bool:
    """True when the servo is there and has not ticked yet."""
    return peek(mapped.control, HEARTBEAT) == 0 and _runs(mapped)


def is_held(control: Cells) -> bool:
    """True when a servo is held by a panic or a fault, or will be at its next tick; of a dead one: or would be."""
    # In this order: a servo that obeys a panic says that it is held before it says that it has seen it.
    return peek(control, PANIC) != peek(control, PANICS_SEEN) or peek(control, HELD) != 0


def was_held(folder: Path) -> bool:
    """True when the servo whose block lies in `folder` is or was held; also when that cannot be known."""
    try:
        found = read_header(folder)
    except OSError:
        return True
    return found is not None and is_held(found.control)


def is_stuck(folder: Path) -> bool:
    """True when the servo whose block lies in `folder` is there and does not tick; also when that cannot be known."""
    try:
        found = read_header(folder)
    except OSError:
        return True
    # One that died is its supervisor's business.
    return found is not None and not is_alive(found.control) and _runs(found)


def _runs(mapped: BlockHeader) -> bool:
    try:
        os.kill(mapped.pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def invalidate(folder: Path) -> None:
    """Mark the block for another scene: of it only whether its servo was held will be taken over.

    The file stays: a gateway that has not noticed yet may raise a panic in it until there is a new one.
    """
    try:
        found = read_header(folder)
    except OSError:
        return
    if found is not None:
        found.header[SIGNATURE_CELL] = INVALID_SIGNATURE


def raise_panic(folder: Path, mapped: BlockHeader) -> None:
    """Panic to whichever servo's block is in place when this returns; `mapped` is the newest one that is known.

    A servo looks into the block before its own once more when its own is in place, and here it is the other way round:
    one of the two sees the other, so no panic that was raised is lost between two servos, whoever dies then.
    """
    while True:
        add_to(mapped.control, PANIC, 1)
        try:
            newest = read_header(folder)
        except OSError:  # whatever lies there, who starts upon it starts held
            return
        if newest is None or newest.boot == mapped.boot:
            return
        mapped = newest
