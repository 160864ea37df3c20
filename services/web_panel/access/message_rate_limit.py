"""Rate limit of a page's messages. Pure."""

_PER_S = 250.0  # a page moves a slider 20 times a second, its camera 60 times, and a pad as often
_AT_ONCE = 1000.0


class MessageRateLimit:
    """Rate limit of one connection: 250 messages a second, and as many more as it has saved up, 1000 at most."""

    def __init__(self, now_s: float) -> None:
        self._left, self._at_s = _AT_ONCE, now_s

    def allows(self, now_s: float) -> bool:
        """One more message."""
        self._left = min(_AT_ONCE, self._left + _PER_S * (now_s - self._at_s)) - 1.0
        self._at_s = now_s
        return self._left >= 0.0
