"""Zenoh queries, answered one after another on a thread of their own: nothing here can stop zenoh's delivery."""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from protocol import messages
from protocol.rate_limited_log import RateLimitedLog

if TYPE_CHECKING:
    import zenoh

_log = logging.getLogger(__name__)
_MAX_QUEUED = 256
_SETTLE_PERIOD_S = 0.005
_QUIET_S = 10.0


def _nothing_open() -> bool:
    return False


class Questions:
    """`answer` is given each query and says whether it is done with; ValueError refuses it in words.

    `settle` is called after each answer, and every 5 ms while it says that something is still open.
    """

    def __init__(
        self,
        name: str,
        answer: Callable[[zenoh.Query], bool],
        settle: Callable[[], bool] = _nothing_open,
    ) -> None:
        self._answer = answer
        self._settle = settle
        self.refused = 0
        self._faults = RateLimitedLog(time.monotonic_ns, _QUIET_S, lambda line: _log.error("%s", line))
        self._queries: queue.Queue[zenoh.Query | None] = queue.Queue(_MAX_QUEUED)
        self._thread = threading.Thread(target=self._answer_all, name=name, daemon=True)
        self._thread.start()

    def receive(self, query: zenoh.Query) -> None:
        """Queue a query, or refuse it. For zenoh's threads; never waits."""
        try:
            self._queries.put_nowait(query)
        except queue.Full:
            self._refuse(query, "too many queries at once: ask again")

    def close(self) -> None:
        """Stop answering."""
        self._queries.put(None)
        self._thread.join(2.0)

    def _answer_all(self) -> None:
        is_open = False
        while True:
            try:
                query = self._queries.get(timeout=_SETTLE_PERIOD_S if is_open else 0.5)
            except queue.Empty:
                is_open = self._settle_open()
                continue
            if query is None:
                return
            self._answer_or_refuse(query)
            is_open = self._settle_open()

    def _settle_open(self) -> bool:
        try:
            return self._settle()
        except Exception as error:  # noqa: BLE001  as in an answer
            self._faults.warn(f"an open query could not be answered: {error!r}")
            return False

    def _answer_or_refuse(self, query: zenoh.Query) -> None:
        try:
            if self._answer(query):
                query.drop()  # not left to the collector: until then the asker waits for more
        except ValueError as error:  # a Refusal and a PresetError are
            self._refuse(query, str(error))
        except Exception as error:  # noqa: BLE001  one question that fails must not silence all that come after it
            self._faults.warn(f"query {query.key_expr} could not be answered: {error!r}")
            self._refuse(query, f"a fault of ours: {error}")

    def _refuse(self, query: zenoh.Query, reason: str) -> None:
        self.refused += 1
        refuse(query, reason)


def refuse(query: zenoh.Query, reason: str) -> None:
    """An error reply, and the query is done with."""
    query.reply_err(messages.encode(messages.RefusalReply(reason=reason)), encoding=messages.ENCODING)
    query.drop()


def payload_of(query: zenoh.Query) -> bytes:
    """The query's payload; empty when it has none."""
    return query.payload.to_bytes() if query.payload is not None else b""
