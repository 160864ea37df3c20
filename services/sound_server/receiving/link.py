"""The haptic server over Zenoh: asking for its scene and its clock, listening to its strikes, telling it how we are.

A session that is open returns by itself to a router that went away; subscriptions and the liveliness token come back
with it. Samples are put into queues, each read by its own thread: one slow reader stops no other.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any, cast

import zenoh

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import SceneError, from_tables
from protocol.clock import ClockMap, HapticClock, asked_clock
from protocol.keys import Keys
from protocol.messages import ENCODING, Meter, encode
from protocol.rate_limited_log import RateLimitedLog
from sound_server.receiving.subscription import Subscription

_QUERY_S = 0.5


def _last(key: str) -> str:
    return key.rpartition("/")[2]


class Link:
    """One rig's. Methods belong to the main thread; the session ends before `close`, and may be shared with others."""

    def __init__(self, session: zenoh.Session, keys: Keys, limited_log: RateLimitedLog) -> None:
        self._session = session
        self.keys = keys
        self._log_limited = limited_log
        self._subscriptions: list[Subscription] = []
        self._token: zenoh.LivelinessToken | None = None
        self._contacts: Subscription | None = None
        self._params: Subscription | None = None
        self._clock_map = ClockMap()

    def scene(self, parameters: str = "") -> Scene | None:
        """The haptic server's scene; None when nobody answers, or with nonsense (logged). Blocks up to 0.5 s.

        `parameters` "?next": the one that is made ready while another plays.
        """
        payload = self._ask(f"{self.keys.scene}{parameters}")
        if payload is None:
            return None
        try:
            tables: object = json.loads(payload)
            if not isinstance(tables, dict):
                raise ValueError("not a JSON object")
            return from_tables(cast(dict[str, Any], tables))
        except SceneError as error:
            self._log_limited.warn(f"scene refused: {error.mistakes[0]}")
        except (ValueError, RecursionError) as error:
            self._log_limited.warn(f"scene refused: {error}")
        return None

    def clock(self) -> HapticClock | None:
        """The haptic machine's clock, from five round trips; None when nobody answers."""
        return asked_clock(self._clock_map, lambda: self._ask(self.keys.clock), self._log_limited.warn)

    @property
    def clock_pause_s(self) -> float:
        """Pause before the clock is asked for again."""
        return self._clock_map.pause_s

    def _ask(self, key: str) -> bytes | None:
        return next((payload for _, payload in self._asked(key)), None)

    def _asked(self, key: str) -> Iterator[tuple[str, bytes]]:
        # Key and payload of each answer.
        try:
            for reply in self._session.get(key, timeout=_QUERY_S):
                if reply.ok is not None:
                    yield str(reply.ok.key_expr), reply.ok.payload.to_bytes()
        except zenoh.ZError as error:
            self._log_limited.warn(f"{key}: {error}")

    def listen(self, takes: Mapping[str, Callable[[bytes, int], None]]) -> None:
        """Call `takes[key](payload, monotonic ns)` for every sample of these keys, in the order in which they come, on
        a thread of their own."""
        self._subscriptions.append(
            Subscription(self._session, list(takes), lambda key, payload, ns: takes[key](payload, ns))
        )

    def subscribe_contacts(self, take: Callable[[bytes, int], None] | None) -> None:
        """Call `take(payload, monotonic ns)` for every piece of a contact, on a thread of its own; None: not any more.

        Only while somebody hears them are they published at all.
        """
        if take is None and self._contacts is not None:
            self._contacts.close()
            self._contacts = None
        elif take is not None and self._contacts is None:
            self._contacts = Subscription(
                self._session, [self.keys.contact], lambda _key, payload, ns: take(payload, ns)
            )

    def subscribe_params(self, take: Callable[[str, bytes], None]) -> None:
        """Call `take(name, payload)` for every readback from now on, on a thread of its own."""
        if self._params is None:
            self._params = Subscription(
                self._session, [self.keys.param("*")], lambda key, payload, _ns: take(_last(key), payload)
            )

    def params(self) -> dict[str, bytes]:
        """All readbacks by name; none when nobody answers. Blocks up to 0.5 s."""
        return {_last(key): payload for key, payload in self._asked(self.keys.param("*"))}

    def announce(self, instance: str) -> None:
        """Be seen as alive/sound/<instance> for as long as the session lives."""
        self._token = self._session.liveliness().declare_token(self.keys.alive("sound", instance))

    def publish(self, meter: Meter) -> None:
        """Publish the meter; dropped without a router."""
        try:
            self._session.put(self.keys.meter, encode(meter), encoding=zenoh.Encoding(ENCODING))
        except zenoh.ZError as error:
            self._log_limited.warn(f"meter not sent: {error}")

    def publisher(self, key: str) -> zenoh.Publisher:
        """Publisher of a key that is put to only while somebody subscribes. It ends with the session."""
        return self._session.declare_publisher(
            key, encoding=zenoh.Encoding(ENCODING), congestion_control=zenoh.CongestionControl.DROP
        )

    def close(self) -> None:
        """Wait for the readers, which end with the session."""
        if self._contacts is not None:
            self._contacts.end()
        if self._params is not None:
            self._params.end()
        for subscription in self._subscriptions:
            subscription.end()
