"""Limits on what one session at the public listener may declare and ask for; one that goes beyond is ended.

Each token or subscription of a stranger is carried to the gateway's own router, where thousands of them hold up
strikes, most of all when they end at once. Zenoh limits none of it (its access rules know keys, no numbers), so what
its log tells is counted here.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from haptic_server.set_rate_limit import PATIENCE_S, SETS_A_SECOND, SetRateLimit, Verdict

# Different keys of each kind that one session may name in its life. A page names some twenty, a program that follows
# the play fewer; a venue's router speaks for all behind it. Thousands that came and went made strikes 0.26 s late.
MOST: dict[str, tuple[int, str]] = {
    "Liveliness Token": (256, "liveliness tokens"),
    "Declare Subscriber": (256, "subscriptions"),
    "Declare Liveliness Subscriber": (256, "subscriptions to tokens"),
    "Liveliness Query": (1024, "keys of tokens asked for"),
    "Query": (1024, "keys asked for"),
}
_MAX_SESSIONS = 2000


class SessionLimits:
    """Counts of every session that is in. One thread: the one that reads Zenoh's log."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._rate_limit = (
            SetRateLimit()
        )  # the gateway cannot tell who asks, so a flood of sets has to end here
        self._named: dict[
            str, dict[str, set[int]]
        ] = {}  # session -> kind -> hashes of keys: a key may be long

    def spend(self, who: str, kind: str, key: str) -> str:
        """Note what a session did. Empty while it keeps within its limits, else which one it went beyond, in words."""
        if kind not in MOST:
            return ""
        if kind == "Query" and self._rate_limit.judge(who, self._now()) is Verdict.HELD_FIRST:
            return f"more than {SETS_A_SECOND:g} queries a second for {PATIENCE_S:g} s"
        if who not in self._named and len(self._named) >= _MAX_SESSIONS:
            del self._named[next(iter(self._named))]
        most, words = MOST[kind]
        keys = self._named.setdefault(who, {}).setdefault(kind, set())
        keys.add(hash(key))
        if len(keys) <= most:
            return ""
        del self._named[who]
        return f"more than {most} {words}"
