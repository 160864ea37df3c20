"""A Zenoh session without a network: what the gateway puts reaches the listeners of this process, as bytes, at once."""

from collections.abc import Callable
from typing import Any, NamedTuple

Take = Callable[[bytes], None]


class _Matching(NamedTuple):
    matching: bool


class _Publisher:
    def __init__(self, session: "LocalSession", key: str) -> None:
        self._session, self._key = session, key

    def put(self, payload: bytes) -> None:
        self._session.put(self._key, payload)

    @property
    def matching_status(self) -> _Matching:
        return _Matching(self._session.is_subscribed(self._key))


class LocalSession:
    """The part of a session that the gateway's wire uses to publish; queries reach nobody. One thread."""

    def __init__(self) -> None:
        self._listeners: dict[str, list[Take]] = {}
        self.put_bytes = 0

    def subscribe(self, key: str, take: Take) -> None:
        """Call `take` with each payload of this key."""
        self._listeners.setdefault(key, []).append(take)

    def is_subscribed(self, key: str) -> bool:
        """True when somebody takes this key's payloads."""
        return key in self._listeners

    def declare_publisher(self, key: str, **_: Any) -> _Publisher:
        """Like zenoh's."""
        return _Publisher(self, key)

    def put(self, key: str, payload: bytes, **_: Any) -> None:
        """Like zenoh's."""
        self.put_bytes += len(payload)
        for take in self._listeners.get(key, ()):
            take(payload)

    def declare_queryable(self, key: str, receive: Any) -> str:
        """Like zenoh's; what is declared is kept by the caller."""
        return f"{key} {receive}"

    def liveliness(self) -> "LocalSession":
        """Like zenoh's."""
        return self

    def declare_token(self, key: str) -> str:
        """Like zenoh's."""
        return key
