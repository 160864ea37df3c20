"""Publishes the force of contacts, for a scene that streams it, and only while somebody subscribes.

Belongs to the relay thread. It asks Zenoh at most two hundred times a second whether anybody does. While nobody does,
that is all, and the servo, told so in the ring's LISTENED cell, writes nothing.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drumstick.parameters.scene import Scene
from haptic_server import contacts as rings
from haptic_server.block_header import BlockError, Cells
from haptic_server.gateway.zenoh.contact_pieces import Pieces
from protocol import messages
from protocol.keys import Keys
from realtime import ring
from realtime.atomics import peek, poke

if TYPE_CHECKING:
    import zenoh

_log = logging.getLogger("gateway")
_POLL_EVERY_NS = 5_000_000
_AT_ONCE = 256


class Contacts:
    """Contacts of one servo on one session, across the servo's restarts. `folder` holds the contact file."""

    def __init__(
        self, session: zenoh.Session, key: str, folder: Path, rate_Hz: float, boot: Callable[[], int]
    ) -> None:
        import zenoh

        self._publisher = session.declare_publisher(key, encoding=zenoh.Encoding(messages.ENCODING))
        self._folder = folder
        self._boot = boot
        self._pieces = Pieces(rate_Hz)
        self._samples = np.zeros(_AT_ONCE, rings.SAMPLE)
        self._ring: rings.ContactRing | None = None
        self._no_cells = ring.new_cells()
        self._wanted = False
        self._poll_ns = 0
        self._put = 0
        self._reported = ""
        ring.drain(
            rings.in_memory().cells, rings.in_memory().slots, self._samples
        )  # compiled, or loaded, now

    def step(self, now_ns: int) -> None:
        """Hand on what the servo told since the last call."""
        if now_ns >= self._poll_ns:
            self._poll_ns = now_ns + _POLL_EVERY_NS
            self._poll()
        if not self._wanted or self._ring is None:
            return
        count = ring.drain(self._ring.cells, self._ring.slots, self._samples)
        for piece in self._pieces.of(self._ring.boot, self._samples[:count], now_ns):
            self._publisher.put(messages.encode(piece))
            self._put += 1

    @property
    def cells(self) -> Cells:
        """Counters of the ring that is listened to; those of an empty one while there is none."""
        return self._ring.cells if self._ring is not None else self._no_cells

    def counters(self) -> dict[str, int | bool]:
        """Counts for `doctor`: messages put, samples that found the ring full, and those too old to be put."""
        dropped = peek(self._ring.cells, ring.DROPPED) if self._ring is not None else 0
        return {"wanted": self._wanted, "put": self._put, "dropped": dropped, "stale": self._pieces.stale}

    def close(self) -> None:
        """Publish nothing from now on; the session stays."""
        self._listen(None)
        self._publisher.undeclare()

    def _poll(self) -> None:
        status: Any = self._publisher.matching_status  # zenoh's own annotation says bool, which it is not
        wanted: bool = status.matching
        found = self._ring if wanted else None
        if wanted and (found is None or found.boot != self._boot()):
            found = self._attached()
        if found is not self._ring:
            self._listen(found)
        self._wanted = wanted

    def _attached(self) -> rings.ContactRing | None:
        # The servo makes the file just after its block: one of another start is one from before.
        try:
            found = rings.attach(self._folder)
        except FileNotFoundError:
            return None
        except BlockError as error:
            if str(error) != self._reported:
                self._reported = str(error)
                _log.warning("contacts cannot be published: %s", error)
            return None
        return found if found.boot == self._boot() else None

    def _listen(self, found: rings.ContactRing | None) -> None:
        # From one ring, or none, to another; what lies there from before is nobody's any more.
        if self._ring is not None:
            poke(self._ring.cells, rings.LISTENED, 0)
        self._pieces.clear()
        self._ring = found
        if found is not None:
            while ring.drain(found.cells, found.slots, self._samples):
                pass
            poke(found.cells, rings.LISTENED, 1)


def contacts_of(
    scene: Scene, session: zenoh.Session, keys: Keys, folder: Path, boot: Callable[[], int]
) -> Contacts | None:
    """Publisher of contacts for a scene that streams; None for any other."""
    if scene.drum.excitation != "streamed":
        return None
    return Contacts(session, keys.contact, folder, float(scene.servo.rate_Hz), boot)
