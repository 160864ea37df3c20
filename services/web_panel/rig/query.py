"""A query under way, polled and never waited for; and one that is asked until somebody answers."""

from collections.abc import Callable

import zenoh

_TIMEOUT_S = 1.0


class Query:
    """Query of one key; `heard` grows until it has ended. Main thread."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        # With a ring channel zenoh drops replies that were not fetched when the query ends.
        self._replies = session.get(key, timeout=_TIMEOUT_S)
        self.heard: list[zenoh.Sample] = []

    def ended(self) -> bool:
        """True when every reply is in, or its time is over. Never blocks."""
        try:
            while (reply := self._replies.try_recv()) is not None:
                if reply.ok is not None:
                    self.heard.append(reply.ok)
        except zenoh.ZError:
            return True  # how zenoh says that every reply is in
        return False


class RepeatedQuery:
    """Repeated query of one key while `stale`, until an answer is read: it can get lost. `read` takes each answer, and
    says whether it could be read. Times are seconds of one clock. Main thread."""

    def __init__(
        self, session: zenoh.Session, key: str, read: Callable[[zenoh.Sample], bool], again_s: float = 1.0
    ) -> None:
        self._session, self._key, self._read, self._again_s = session, key, read, again_s
        self._question: Query | None = None
        self._asked_at = float("-inf")
        self.stale = True

    def ask_at_once(self) -> None:
        """Ask again at once: the last answer is out of date."""
        self.stale, self._asked_at = True, float("-inf")

    def follow(self, now: float) -> None:
        """Take the answers that have come, and ask when it is time. Never blocks."""
        if self._question is not None and self._question.ended():
            read = [self._read(sample) for sample in self._question.heard]
            self.stale = self.stale or not any(read)
            self._question = None
        if self.stale and self._question is None and now - self._asked_at >= self._again_s:
            self._question, self._asked_at = Query(self._session, self._key), now
            self.stale = False  # whoever says so from now on wants another answer than this one
