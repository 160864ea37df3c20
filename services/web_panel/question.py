"""A query under way, polled and never waited for."""

import zenoh

_TIMEOUT_S = 1.0


class Question:
    """Of one key, `heard` grows until it has ended. Main thread."""

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
