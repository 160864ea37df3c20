"""Messages held back after the gateway has opened its router, until the subscribers are back.

Whoever listens on this machine is connected to the gateway itself, and connects again when another one starts. What
the servo did in the meantime waits in the block; published at once, it would reach nobody. The relay's thread.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import zenoh

# Clients of this machine try every protocol.session.RETRY_S: after the first, so long for the others.
_AFTER_THE_FIRST_S = 0.25
_MAX_S = 0.75


class Backlog:
    """Messages of a gateway that has just started, in order, until its subscribers are back or 0.75 s have passed."""

    def __init__(self, awaited: zenoh.Publisher) -> None:
        """awaited: publishes what the subscribers are awaited for."""
        self._awaited = awaited
        self._held: list[tuple[zenoh.Publisher, bytes]] = []
        self._until_s = time.monotonic() + _MAX_S
        self._is_matched = False
        self._is_over = False

    @property
    def is_over(self) -> bool:
        """True when nothing is held back any more."""
        return self._is_over

    def put(self, publisher: zenoh.Publisher, payload: bytes) -> None:
        """Publish by `publisher`: now, or when the subscribers are back."""
        if self._is_over:
            publisher.put(payload)
        else:
            self._held.append((publisher, payload))

    def step(self, now_s: float) -> None:
        """Look whether they are; now_s: time.monotonic()."""
        if self._is_over:
            return
        subscribed: Any = self._awaited.matching_status  # a MatchingStatus, though zenoh's stub says bool
        if not self._is_matched and subscribed.matching:
            self._is_matched = True
            self._until_s = min(self._until_s, now_s + _AFTER_THE_FIRST_S)
        if now_s < self._until_s:
            return
        for publisher, payload in self._held:
            publisher.put(payload)
        self._held.clear()
        self._is_over = True
