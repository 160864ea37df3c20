"""The recorder's own Zenoh session: everything that is recorded, heard and queued for the writing thread.

Each subscription ends in a ring channel that a thread of its own empties, and all of them into one queue: neither a
slow disk nor a busy writer holds up anything outside this process. What finds the queue full is counted by topic.
"""

import os
import queue
import secrets
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

import zenoh

from protocol.clock import ClockMap, HapticClock, asked_clock
from protocol.session import open_client
from realtime.stop import StopRequest
from rig.network.remote import attempt
from rig.network.remote_rig import RemoteRig
from rig.recording import channels
from rig.recording.channels import Channel, Presence

_RING = 4096
_QUEUED = 100_000  # a minute of everything at its busiest
_QUERY_S = 0.5


class Received(NamedTuple):
    """One sample: its channel, the last part of its key, its payload, when it came (monotonic ns)."""

    channel: Channel
    name: str
    payload: bytes
    received_ns: int


class Appeared(NamedTuple):
    """A liveliness token that appeared or went."""

    presence: Presence
    received_ns: int


class NewClock(NamedTuple):
    """A measurement of the haptic machine's clock."""

    clock: HapticClock
    received_ns: int


class NewScene(NamedTuple):
    """Answer to the `scene` query, in a start of the servo."""

    payload: bytes
    boot: int
    received_ns: int


Item = Received | Appeared | NewClock | NewScene


class RecorderSession:
    """Subscriptions to one rig. `open`, `close`, questions: the main thread; `items`: the writing one."""

    def __init__(self, end: RemoteRig) -> None:
        self._end = end
        self.refused = ""
        self._keys = end.keys
        self._session: zenoh.Session | None = None
        self._token: zenoh.LivelinessToken | None = None
        self._clock_map = ClockMap()
        self._readers: list[threading.Thread] = []
        self._heard: list[tuple[Any, Channel]] = []
        self._order = threading.Lock()
        self._published: set[str] = set()  # keys, since the parameters were asked for
        self.items: queue.Queue[Item] = queue.Queue(_QUEUED)
        self.overrun: Counter[str] = Counter()  # by topic: found the queue full

    def open(self, stop: StopRequest, wait: bool) -> bool:
        """Join the rig's router until `stop` is set; without `wait` only if one listens there. Whether there is one.

        If not, `refused` has the reason, where one was told.
        """
        if wait:
            self._session = open_client(self._end.endpoint, lambda: not stop.is_set(), self._end.identity)
        else:
            self._session, self.refused = attempt(self._end, lambda: not stop.is_set())
        return self._session is not None

    @property
    def session(self) -> zenoh.Session:
        """The session, once it is open."""
        assert self._session is not None
        return self._session

    def listen(self, force: bool) -> None:
        """Subscribe to all that is recorded; with `force` also to `contact`, which makes the rig stream."""
        keys = self._keys
        heard = {
            keys.strike: channels.STRIKE,
            keys.release: channels.RELEASE,
            keys.choke: channels.CHOKE,
            keys.state: channels.STATE,
            keys.meter: channels.METER,
            keys.param("*"): channels.PARAM,
        }
        if force:
            heard[keys.contact] = channels.CONTACT
        for key, channel in heard.items():
            subscriber = self.session.declare_subscriber(key, zenoh.handlers.RingChannel(_RING))
            self._read_by_thread(subscriber, channel)
        tokens = self.session.liveliness().declare_subscriber(
            keys.alive("*", "*"), zenoh.handlers.RingChannel(_RING), history=True
        )
        self._read_by_thread(tokens, channels.ALIVE)
        instance = f"{os.getpid():x}-{secrets.token_hex(3)}"
        self._token = self.session.liveliness().declare_token(keys.alive("record", instance))

    def _read_by_thread(self, subscriber: Any, channel: Channel) -> None:
        def read() -> None:
            while True:
                try:
                    sample: zenoh.Sample = subscriber.recv()
                except zenoh.ZError:  # the session was closed
                    return
                with self._order:
                    self._published.add(str(sample.key_expr))
                    self._put(channel, _item(channel, sample, time.monotonic_ns()))

        reader = threading.Thread(target=read, name=f"record{channel.topic}", daemon=True)
        reader.start()
        self._readers.append(reader)
        self._heard.append((subscriber, channel))

    def _put(self, channel: Channel, item: Item) -> None:
        try:
            self.items.put_nowait(item)
        except queue.Full:
            self.overrun[channel.topic] += 1

    def scene(self) -> bytes | None:
        """The scene's JSON; None when nobody answers. Blocks up to 0.5 s, as every question."""
        return next((sample.payload.to_bytes() for sample in self._asked(self._keys.scene)), None)

    def clock(self, warn: Callable[[str], None]) -> HapticClock | None:
        """The haptic machine's clock; None when nobody answers."""
        key = self._keys.clock

        def answer() -> bytes | None:
            return next((sample.payload.to_bytes() for sample in self._asked(key)), None)

        return asked_clock(self._clock_map, answer, warn)

    def ask_params(self) -> None:
        """Queue the readback of every parameter, as if it had just been published, unless a newer one was meanwhile."""
        with self._order:
            self._published.clear()
        for sample in self._asked(self._keys.param("*")):
            with self._order:
                if str(sample.key_expr) not in self._published:
                    self._put(channels.PARAM, _item(channels.PARAM, sample, time.monotonic_ns()))

    def _asked(self, key: str) -> list[zenoh.Sample]:
        try:
            replies = list(self.session.get(key, timeout=_QUERY_S))
        except zenoh.ZError:  # the router is away: no answer
            return []
        return [reply.ok for reply in replies if reply.ok is not None]

    def close(self) -> None:
        """Leave; when it returns, everything heard is in `items`. Without it the process would not end."""
        if self._session is not None:
            self._empty_rings()  # they go with the session
            self._session.close()
            self._session = None
        for reader in self._readers:
            reader.join()

    def _empty_rings(self) -> None:
        for subscriber, channel in self._heard:
            for _ in range(_RING):
                sample: zenoh.Sample | None = subscriber.try_recv()
                if sample is None:
                    break
                self._put(channel, _item(channel, sample, time.monotonic_ns()))


def _item(channel: Channel, sample: zenoh.Sample, received_ns: int) -> Item:
    key = str(sample.key_expr)
    if channel is channels.ALIVE:
        service, ident = key.rsplit("/", 2)[1:]
        here = sample.kind == zenoh.SampleKind.PUT
        return Appeared(Presence(service=service, id=ident, alive=here), received_ns)
    return Received(channel, key.rpartition("/")[2], sample.payload.to_bytes(), received_ns)
