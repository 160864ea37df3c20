"""Streamed forces for the offline renderer: as a servo would have told them, without a network and without delay."""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drumstick.drum.engine import Engine
from drumstick.drum.excitation.feed import Feed
from drumstick.drum.memory.timeline import PIECE_MOST
from realtime.records import is_there

_EARLY_S = 0.03  # so long before its instant a piece is given


@dataclass(frozen=True)
class StreamedContact:
    """One contact: force means over ticks (N), the first at first_tick / rate_Hz seconds, at (x, y) in radii.

    `begins`: False for a later piece of a contact that came in pieces. All contacts of a rendering have one rate; ticks
    that two of them share add up.
    """

    first_tick: int
    rate_Hz: float
    x: float
    y: float
    forces_N: npt.NDArray[np.float64]
    begins: bool = True


class ContactFeeder:
    """Gives contacts to an engine as its time comes; `epoch_ns` is the engine's time 0."""

    def __init__(self, engine: Engine, contacts: Iterable[StreamedContact], epoch_ns: int) -> None:
        found = sorted(contacts, key=lambda contact: contact.first_tick)
        if len({contact.rate_Hz for contact in found}) > 1:
            raise ValueError("contacts of different rates: bring them to one")
        if not is_there(engine.stream):
            raise ValueError('the scene does not stream: [drum] excitation = "streamed"')
        self.is_pressed = False  # what was given last ended within a contact
        self._next: Feed | None = None
        self.move_to(engine)
        self._epoch_ns = epoch_ns
        self._waiting = deque(sorted(_pieces(found), key=lambda piece: piece.first_tick))

    def move_to(self, engine: Engine) -> None:
        """Give to this engine from now on."""
        self._feed, self._next = Feed(engine.stream), None

    def move_on_to(self, engine: Engine) -> None:
        """Give to this engine from the next contact on: the rest of one that goes on stays where it began."""
        self._next = Feed(engine.stream)

    def give(self, until_s: float, other_s: float = math.inf) -> None:
        """All pieces that begin before until_s, and a little more, as far as the ring takes them; no contact that
        begins from other_s on, for another engine is to get that."""
        while self._waiting:
            piece = self._waiting[0]
            start_s = piece.first_tick / piece.rate_Hz
            forces = piece.forces_N.astype(np.float32)
            if start_s >= until_s + _EARLY_S or (start_s >= other_s and not self.is_pressed):
                return
            if self._next is not None and not self.is_pressed:
                self._feed, self._next = self._next, None
            if not self._feed.push(
                1, piece.first_tick, self._epoch_ns + round(start_s * 1e9), 1e9 / piece.rate_Hz,
                piece.x, piece.y, forces,
            ):  # fmt: skip
                return
            self.is_pressed = bool(forces[-1] != 0.0) and not self._ends(piece)
            self._waiting.popleft()

    def _ends(self, piece: StreamedContact) -> bool:
        # Nothing follows it at once.
        following = self._waiting[1].first_tick if len(self._waiting) > 1 else math.inf
        return following > piece.first_tick + len(piece.forces_N)


def _pieces(contacts: Iterable[StreamedContact]) -> Iterable[StreamedContact]:
    for contact in contacts:
        for done in range(0, len(contact.forces_N), PIECE_MOST):
            forces = contact.forces_N[done : done + PIECE_MOST]
            yield StreamedContact(contact.first_tick + done, contact.rate_Hz, contact.x, contact.y, forces)
