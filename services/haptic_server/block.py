"""The block: one memory-mapped file (0600) between servo and gateway.

The servo makes a new one at each start and moves it into place whole, so a reader sees all of a block or none. Its
contents are numpy views; only the compiled code of `realtime` touches the parts that both sides write. A reader that
dies, even by SIGKILL, leaves the file and the servo untouched.
"""

import errno
import hashlib
import mmap
import os
import secrets
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from haptic_server.block_header import (
    BOOT_CELL,
    CONTROL_CELLS,
    HEADER_CELLS,
    HELD,
    INVALID_SIGNATURE,
    MAGIC,
    MAGIC_CELL,
    PID_CELL,
    SIGNATURE_CELL,
    BlockError,
    BlockHeader,
    Cells,
    is_held,
    read_header,
)
from haptic_server.files import BLOCK
from haptic_server.records import EVENT, POINTER, STATUS, set_type
from realtime import ring, triple_buffer
from realtime.atomics import peek, poke

RING_SLOTS = 16384  # three minutes of a roll at 45 Hz, two events a contact
LATENESS_BINS = 512
LATENESS_BIN_NS = 10_000  # the last bin takes everything above 5.1 ms
_LAYOUT_VERSION = 2
_POINTED = 4

Slots = npt.NDArray[np.void]


class Block(NamedTuple):
    """Views into the mapped file. numba takes the whole tuple as one argument.

    header: magic, layout, boot, pid, pointed. control: STOP, PANIC, ARM, HEARTBEAT, HELD (0, 1 for a panic, 1 + fault),
    PANICS_SEEN. Events flow servo -> gateway; `wanted_*` and `pointer_*` are gateway -> servo; `live_*` (readback) and
    `status_*` are servo -> gateway. lateness: ticks per bin of 10 us.
    """

    header: Cells
    control: Cells
    ring_cells: Cells
    wanted_cells: Cells
    live_cells: Cells
    status_cells: Cells
    pointer_cells: Cells
    lateness: Cells
    wanted: Slots
    live: Slots
    status: Slots
    pointer: Slots
    events: Slots

    @property
    def boot(self) -> int:
        """Identifies this start of the servo."""
        return int(self.header[BOOT_CELL])

    @property
    def header_view(self) -> BlockHeader:
        """The part that every version understands."""
        return BlockHeader(self.header, self.control)

    @property
    def pid(self) -> int:
        """Process id of the servo."""
        return int(self.header[PID_CELL])

    @property
    def is_pointed(self) -> bool:
        """True when the servo's device is a hand that follows a pointer; no other device has code that looks at one."""
        return bool(self.header[_POINTED])

    def follow_pointer(self) -> None:
        """Say so. The servo, before its first tick."""
        self.header[_POINTED] = 1


class InheritedState(NamedTuple):
    """The newest accepted set, which a servo leaves to the one that is started in its place."""

    revision: int
    law: Slots


def _layout(law: np.dtype[Any]) -> list[tuple[str, np.dtype[Any], int]]:
    # Header and control are the block header: first, and as they are, in every version and for every scene.
    cells = np.dtype(np.int64)
    sets = set_type(law)
    return [
        ("header", cells, HEADER_CELLS),
        ("control", cells, CONTROL_CELLS),
        ("ring_cells", cells, ring.CELLS),
        ("wanted_cells", cells, triple_buffer.CELLS),
        ("live_cells", cells, triple_buffer.CELLS),
        ("status_cells", cells, triple_buffer.CELLS),
        ("pointer_cells", cells, triple_buffer.CELLS),
        ("lateness", cells, LATENESS_BINS),
        ("wanted", sets, 3),
        ("live", sets, 3),
        ("status", STATUS, 3),
        ("pointer", POINTER, 3),
        ("events", EVENT, RING_SLOTS),
    ]


def _signature(law: np.dtype[Any]) -> int:
    words = f"{_LAYOUT_VERSION}{[(n, d.descr, c) for n, d, c in _layout(law)]}"
    return int.from_bytes(hashlib.sha256(words.encode()).digest()[:7], "little")


def _size(law: np.dtype[Any]) -> int:
    return sum(-(-dtype.itemsize * count // 64) * 64 for _, dtype, count in _layout(law))


def _views(memory: mmap.mmap, law: np.dtype[Any]) -> Block:
    views: dict[str, Any] = {}
    offset = 0
    for name, dtype, count in _layout(law):
        views[name] = np.frombuffer(memory, dtype, count, offset)
        offset += -(-dtype.itemsize * count // 64) * 64
    return Block(**views)


def _map(path: Path) -> mmap.mmap:
    with path.open("r+b") as file:
        return mmap.mmap(file.fileno(), 0)


def in_memory(law: npt.NDArray[np.void]) -> Block:
    """A block without a file, for virtual time and tests; `law` has shape (1,)."""
    block = _views(mmap.mmap(-1, _size(law.dtype)), law.dtype)
    _start(block, law)
    return block


def _start(block: Block, law: npt.NDArray[np.void], revision: int = 0) -> None:
    first = np.zeros(1, set_type(law.dtype))
    first["law"] = law
    first["revision"] = revision
    triple_buffer.clear(block.wanted_cells, block.wanted, first[0])
    triple_buffer.clear(block.live_cells, block.live, first[0])
    triple_buffer.clear(block.status_cells, block.status, np.zeros(1, STATUS)[0])
    triple_buffer.clear(block.pointer_cells, block.pointer, np.zeros(1, POINTER)[0])
    # 40 bits of time and randomness: a new start is told from an old one, and fits every JSON number.
    block.header[:4] = (
        MAGIC,
        _signature(law.dtype),
        (int(time.time()) << 16 | secrets.randbits(16)) & 0xFFFFFFFFFFFF,
        os.getpid(),
    )


def inherited_state(folder: Path, law: np.dtype[Any]) -> InheritedState | None:
    """Values and permission of the servo before this one in `folder`, if it played the same scene; None otherwise.

    Only for a servo that is about to make its own block: it takes the dead one's side.
    """
    try:
        old = attach(folder, law)
    except (FileNotFoundError, BlockError):
        return None
    newest = np.zeros(1, set_type(law))
    while not triple_buffer.recover(old.wanted_cells, triple_buffer.READER, triple_buffer.WRITER):
        time.sleep(0)
    triple_buffer.read_into(old.wanted_cells, old.wanted, newest)
    return InheritedState(int(newest["revision"][0]), newest["law"].copy())


def reserve(path: Path, size: int) -> None:
    """An empty file (0600) with all of its room. OSError, and no file, when there is not so much."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600)
    try:
        if sys.platform == "linux":
            os.posix_fallocate(descriptor, 0, size)
        else:
            os.ftruncate(descriptor, size)
    except OSError:
        path.unlink()
        raise
    finally:
        os.close(descriptor)


def create(folder: Path, law: npt.NDArray[np.void], revision: int = 0) -> Block:
    """Make the servo's block in `folder` (0600), starting from `law`; replaces an older one in one step.

    It says that its servo is held where the one before it was, by a panic that came until this one was in place too.
    OSError when there is no room for all of it: a file with holes would end the servo with SIGBUS in a later tick.
    """
    temporary = folder / f".{BLOCK}.{os.getpid()}"
    reserve(temporary, _size(law.dtype))
    block = _views(_map(temporary), law.dtype)
    _start(block, law, revision)
    # Held until the last word of the block before is known, whose gateway may raise a panic in it up to the rename: a
    # servo that is killed in between leaves a block that is held.
    poke(block.control, HELD, 1)
    try:
        before = read_header(folder)
    except OSError:
        temporary.rename(folder / BLOCK)
        return block
    temporary.rename(folder / BLOCK)
    word = 0 if before is None else peek(before.control, HELD)
    poke(block.control, HELD, word or int(before is not None and is_held(before.control)))
    return block


def attach(folder: Path, law: np.dtype[Any]) -> Block:
    """Map an existing block as its gateway. FileNotFoundError before the servo made one; BlockError if it differs."""
    path = folder / BLOCK
    found = read_header(folder)
    if found is None or int(found.header[SIGNATURE_CELL]) == INVALID_SIGNATURE:
        raise FileNotFoundError(errno.ENOENT, "no servo of this scene has made a block yet", str(path))
    memory = _map(path)
    if len(memory) != _size(law):
        raise BlockError(f"{path}: {len(memory)} bytes, expected {_size(law)}: another version's block")
    block = _views(memory, law)
    if int(block.header[MAGIC_CELL]) != MAGIC or int(block.header[SIGNATURE_CELL]) != _signature(law):
        raise BlockError(f"{path}: made for another scene or version; restart the servo")
    return block


def claim(block: Block) -> None:
    """Take up the gateway's side after an earlier gateway died, at whatever instruction."""
    for cells, own, other in (
        (block.wanted_cells, triple_buffer.WRITER, triple_buffer.READER),
        (block.live_cells, triple_buffer.READER, triple_buffer.WRITER),
        (block.status_cells, triple_buffer.READER, triple_buffer.WRITER),
        (block.pointer_cells, triple_buffer.WRITER, triple_buffer.READER),
    ):
        while not triple_buffer.recover(cells, own, other):
            time.sleep(0)


def inode(folder: Path) -> int:
    """Tells whether the block in place is still the one that was mapped; 0 when there is none."""
    try:
        return (folder / BLOCK).stat().st_ino
    except FileNotFoundError:
        return 0
