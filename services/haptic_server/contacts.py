"""The contact file: the force of each tick in contact, on its way from the servo to the gateway.

A scene whose drum is excited by the force itself (`[drum] excitation = "streamed"`) has one beside its block: a
memory-mapped ring (0600). No other scene has the file, the memory or the code. The gateway says in cell LISTENED
whether anybody wants the force; while nobody does, the servo writes nothing.
"""

import mmap
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from haptic_server.block import Slots, reserve
from haptic_server.block_header import BlockError, Cells
from haptic_server.files import CONTACTS
from realtime import ring
from realtime.records import Record, dtype_of


class Sample(Record):
    """The mean force over the tick that begins at t_ns; `tick` counts ticks since the servo started, `seq` is the
    strike's.
    """

    seq: int
    tick: int
    t_ns: int
    force_N: float
    x: float
    y: float


SAMPLE = dtype_of(Sample)
SLOTS = 4096  # four seconds at 1 kHz, for a gateway that is held up
LISTENED = ring.CELLS  # the first cell behind the ring's own
_CELLS = ring.CELLS + 8
_MAGIC = 0x666F726365  # "force"
_HEADER = 8  # magic, boot
_BYTES = 8 * (_HEADER + _CELLS) + SLOTS * SAMPLE.itemsize


class ContactRing(NamedTuple):
    """Views into the mapped file: header (8,), cells (32,), slots (4096,) of SAMPLE."""

    header: Cells
    cells: Cells
    slots: Slots

    @property
    def boot(self) -> int:
        """The start of the servo that it belongs to."""
        return int(self.header[1])


class Streaming(Record):
    """The present tick began at t_ns and is number `tick`; the force stands for that one and `missed` more before it.
    `streamed_N_s` of the contact's impulse has gone out; `last_N` was the last sample.
    """

    tick: int
    t_ns: int
    missed: int
    inside: int
    streamed_N_s: float
    last_N: float


STREAM = dtype_of(Streaming)


class Stream(NamedTuple):
    """state (1,) of STREAM, sample (1,) of SAMPLE; the ring to the gateway."""

    state: Slots
    sample: Slots
    contacts: ContactRing


def stream_to(contacts: ContactRing) -> Stream:
    """The servo's side of the ring. Control thread."""
    return Stream(np.zeros(1, STREAM), np.zeros(1, SAMPLE), contacts)


def _views(memory: mmap.mmap) -> ContactRing:
    words = np.frombuffer(memory, np.int64, _HEADER + _CELLS)
    slots = np.frombuffer(memory, SAMPLE, SLOTS, words.nbytes)
    return ContactRing(words[:_HEADER], words[_HEADER:], slots)


def _start(contacts: ContactRing, boot: int) -> ContactRing:
    contacts.header[:2] = _MAGIC, boot
    return contacts


def in_memory() -> ContactRing:
    """A ring without a file, for virtual time and rehearsals."""
    return _start(_views(mmap.mmap(-1, _BYTES)), 0)


def create(folder: Path, boot: int) -> ContactRing:
    """Make the servo's contact file in `folder`; replaces an older one in one step. OSError without room for it."""
    temporary = folder / f".{CONTACTS}.{os.getpid()}"
    reserve(temporary, _BYTES)
    contacts = _start(_map(temporary), boot)
    temporary.rename(folder / CONTACTS)
    return contacts


def attach(folder: Path) -> ContactRing:
    """Map an existing one as its gateway. FileNotFoundError before the servo made one; BlockError if it is none."""
    contacts = _map(folder / CONTACTS)
    if int(contacts.header[0]) != _MAGIC:
        raise BlockError(f"{folder / CONTACTS}: no contact file of this version; restart the servo")
    return contacts


def _map(path: Path) -> ContactRing:
    with path.open("r+b") as file:
        memory = mmap.mmap(file.fileno(), 0)
    if len(memory) != _BYTES:
        raise BlockError(
            f"{path}: {len(memory)} bytes, expected {_BYTES}: another version's; restart the servo"
        )
    return _views(memory)
