"""The one place where a key is made to answer queries, and where wildcards are kept from changing anything.

Somebody who looks around asks `drumstick/**`, and Zenoh hands that query to every key that it touches. A key whose
question changes something therefore hears only a query that names it; the others hear every query.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from protocol.query_thread import refuse

if TYPE_CHECKING:
    import zenoh

Receive = Callable[["zenoh.Query"], None]


class Queryables:
    """Queryables of one session. Declared by any thread; `receive` runs on Zenoh's threads, and must not wait."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._kept: list[zenoh.Queryable[None]] = []  # Zenoh forgets one that nobody holds
        self.reading: list[str] = []
        self.writing: list[str] = []
        self.refused = 0

    def declare_reading(self, key: str, receive: Receive) -> None:
        """Questions that change nothing: `receive` also gets those that came by a wildcard."""
        self.reading.append(key)
        self._kept.append(self._session.declare_queryable(key, receive))

    def declare_writing(self, key: str, receive: Receive) -> None:
        """Questions that change something: only a query for this very key, or for one that `key` stands for."""
        self.writing.append(key)

        def receive_named(query: zenoh.Query) -> None:
            asked = str(query.key_expr)
            if "*" in asked:  # no key that is named holds one: it is what makes a pattern
                self.refused += 1
                refuse(query, f"{key} changes something: name one key; wildcards are for reading only")
            else:
                receive(query)

        self._kept.append(self._session.declare_queryable(key, receive_named))

    def undeclare(self) -> None:
        """Answer nobody from now on."""
        for queryable in self._kept:
            queryable.undeclare()
        self._kept.clear()
