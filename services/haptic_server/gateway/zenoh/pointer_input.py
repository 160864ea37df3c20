"""From pointers on the wire to the hand in the block. Relay thread only; nothing here blocks.

Only while the servo's hand follows a pointer is anything heard, and a liveliness token says so: nobody can point at a
rig with a real arm. Several may point at once; the first who holds keeps the stick until he lets go or falls silent.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Protocol

from protocol.foreign_text import shown
from protocol.keys import Keys
from protocol.messages import Pointer, decode

if TYPE_CHECKING:
    import zenoh

_log = logging.getLogger("gateway")
SILENT_NS = 400_000_000  # who points and is not heard for so long has let go, here as in the servo
_AT_ONCE = 8  # in one round; a flood costs that much and no more
_WARN_EVERY_NS = 10_000_000_000


class Pointable(Protocol):
    """The part of a ServoLink used here."""

    @property
    def boot(self) -> int:
        """Identifies the servo's start."""
        ...

    @property
    def is_pointed(self) -> bool:
        """True when this servo's hand follows a pointer."""
        ...

    def point(self, held: bool, lift: float, x: float, y: float) -> None:
        """Tell the servo."""
        ...


class PointerHolder:
    """Sender whose pointer counts."""

    def __init__(self) -> None:
        self._source = ""
        self._seq = -1
        self._held = False
        self._heard_ns = 0

    def admits(self, pointer: Pointer, now_ns: int) -> bool:
        """True when this message counts; one of another's, or one that was overtaken, does not."""
        ours = pointer.source == self._source
        if ours and pointer.seq <= self._seq:
            return False
        if not ours and (not pointer.held or (self._held and now_ns - self._heard_ns <= SILENT_NS)):
            return False
        self._source, self._seq = pointer.source, pointer.seq
        self._held, self._heard_ns = pointer.held, now_ns
        return True


class Pointing:
    """Pointers of one session for one servo, across the servo's restarts."""

    def __init__(self, session: zenoh.Session, keys: Keys, link: Pointable) -> None:
        self._session, self._keys, self.link = session, keys, link
        self._boot = 0
        self._token: zenoh.LivelinessToken | None = None
        self._subscriber: zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]] | None = None
        self._holder = PointerHolder()
        self._warn_at_ns = 0

    def step(self, now_ns: int) -> None:
        """Hand on what has been heard since the last call."""
        if self._boot != self.link.boot or (self._subscriber is not None) != self.link.is_pointed:
            self._follow_servo()
        if self._subscriber is None:
            return
        for _ in range(_AT_ONCE):
            sample = self._subscriber.try_recv()
            if sample is None:
                return
            self._take(sample.payload.to_bytes(), now_ns)

    def _follow_servo(self) -> None:
        import zenoh

        self._boot = self.link.boot
        if self._token is not None:
            self._token.undeclare()
            self._token = None
        if self._subscriber is not None:
            self._subscriber.undeclare()
            self._subscriber = None
        if self.link.is_pointed:
            self._subscriber = self._session.declare_subscriber(
                self._keys.pointer, zenoh.handlers.RingChannel(_AT_ONCE)
            )
            self._token = self._session.liveliness().declare_token(
                self._keys.alive("pointer", f"{self._boot:x}")
            )

    def _take(self, payload: bytes, now_ns: int) -> None:
        try:
            pointer = decode(payload, Pointer)
        except ValueError as error:
            if now_ns >= self._warn_at_ns:
                self._warn_at_ns = now_ns + _WARN_EVERY_NS
                _log.warning("a pointer that cannot be read: %s", shown(error))
            return
        if self._holder.admits(pointer, now_ns):
            self.link.point(
                pointer.held, _within(pointer.lift, 0.0), _within(pointer.x, -1.0), _within(pointer.y, -1.0)
            )


def _within(value: float, low: float) -> float:
    return min(max(value, low), 1.0)
