"""The gateway's Zenoh side: publishes what the servo does, answers queries, takes sets.

`put_*` are for the relay thread. Queries arrive on zenoh's threads, which only queue them; one worker answers, so that
nothing here can stop zenoh's delivery. A set is answered when the servo uses it, or as pending after a while.
"""

from __future__ import annotations

import json
import logging
import math
import queue
import threading
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

from haptic_server.gateway.settings import Echo, ParameterDesk
from protocol import messages
from protocol.keys import Keys
from protocol.requests import requested_value, requested_values

if TYPE_CHECKING:
    import zenoh

_log = logging.getLogger("gateway")
_QUEUED_QUERIES = 256
_ANSWER_PENDING_AFTER_S = 0.15


class _Waiting(NamedTuple):
    query: zenoh.Query
    names: tuple[str, ...]
    single: bool
    revision: int
    until: float


class Wire:
    """Keys of one rig on one Zenoh session."""

    def __init__(
        self,
        session: zenoh.Session,
        keys: Keys,
        desk: ParameterDesk,
        boot: Callable[[], int],
        scene_json: str,
        health: Callable[[], Mapping[str, object]],
    ) -> None:
        import zenoh

        self._session = session
        self._keys = keys
        self._desk = desk
        self._boot = boot
        self._scene_json = scene_json
        self._health = health
        self._encoding = zenoh.Encoding(messages.ENCODING)
        self._json = zenoh.Encoding.APPLICATION_JSON
        self._queries: queue.Queue[zenoh.Query | None] = queue.Queue(_QUEUED_QUERIES)
        self._waiting: list[_Waiting] = []
        self.refused = 0
        self._strike = session.declare_publisher(keys.strike, encoding=self._encoding)
        self._release = session.declare_publisher(keys.release, encoding=self._encoding)
        self._state = session.declare_publisher(keys.state, encoding=self._encoding)
        self._queryables = [
            session.declare_queryable(key, self._receive)
            for key in (
                keys.set_many,
                keys.set_one("*"),
                keys.param("*"),
                keys.scene,
                keys.clock,
                keys.doctor,
                keys.panic,
            )
        ]
        self._token = session.liveliness().declare_token(keys.alive("haptic", f"{boot():x}"))
        self._worker = threading.Thread(target=self._answer_all, name="queries", daemon=True)
        self._worker.start()

    def put_strike(self, strike: messages.Strike) -> None:
        """Publish one strike."""
        self._strike.put(messages.encode(strike))

    def put_release(self, release: messages.Release) -> None:
        """Publish one release."""
        self._release.put(messages.encode(release))

    def put_state(self, state: messages.State) -> None:
        """Publish how the servo stands."""
        self._state.put(messages.encode(state))

    def put_echoes(self, echoes: list[Echo], revision: int, pending: bool) -> None:
        """Publish readbacks."""
        for echo in echoes:
            readback = messages.Readback(value=echo.value, revision=revision, pending=pending)
            self._session.put(self._keys.param(echo.name), messages.encode(readback), encoding=self._encoding)

    def close(self) -> None:
        """Stop answering. The caller closes the session."""
        self._queries.put(None)
        self._worker.join(2.0)

    def _receive(self, query: zenoh.Query) -> None:
        try:
            self._queries.put_nowait(query)
        except queue.Full:
            self._refuse(query, "too many queries at once: ask again")

    def _answer_all(self) -> None:
        while True:
            try:
                query = self._queries.get(timeout=0.005 if self._waiting else 0.5)
            except queue.Empty:
                self._settle()
                continue
            if query is None:
                return
            self._answer_or_refuse(query)
            self._settle()

    def _answer_or_refuse(self, query: zenoh.Query) -> None:
        try:
            if self._answer(query):
                query.drop()  # not left to the collector: until then the asker waits for more
        except ValueError as error:  # a Refusal is one
            self._refuse(query, str(error))
        except Exception as error:  # noqa: BLE001  one question that fails must not silence all that come after it
            _log.error("query %s could not be answered: %r", query.key_expr, error)
            self._refuse(query, f"a fault of the gateway: {error}")

    def _answer(self, query: zenoh.Query) -> bool:
        """Answer now, or queue a set until the servo took it; True when the query is done with."""
        key = str(query.key_expr)
        keys = self._keys
        payload = query.payload.to_bytes() if query.payload is not None else b""
        if key == keys.set_many:
            return self._set(query, requested_values(payload), single=False)
        if key.startswith(keys.set_one("")):
            name = key.removeprefix(keys.set_one(""))
            return self._set(query, {name: requested_value(payload)}, single=True)
        if key.startswith(keys.param("")):
            self._ask(query, key.removeprefix(keys.param("")))
        elif key == keys.scene:
            query.reply(keys.scene, self._scene_json, encoding=self._json)
        elif key == keys.clock:
            clock = messages.Clock(boot=self._boot(), t_ns=time.monotonic_ns())
            query.reply(keys.clock, messages.encode(clock), encoding=self._encoding)
        elif key == keys.doctor:
            query.reply(keys.doctor, json.dumps(self._health()), encoding=self._json)
        elif key == keys.panic:
            self._desk.panic("zenoh")
            query.reply(keys.panic, messages.encode(messages.Message()), encoding=self._encoding)
        else:
            raise ValueError(f"{key}: name one key; wildcards are for param/* only")
        return True

    def _ask(self, query: zenoh.Query, name: str) -> None:
        echoes = [e for e in self._desk.everything() if name in ("*", "**", e.name)]
        if not echoes:
            raise ValueError(f"{name}: no such parameter in this scene; it has {', '.join(self._desk.table)}")
        for echo in echoes:
            readback = messages.Readback(
                value=echo.value, revision=self._desk.live_revision, pending=self._desk.pending
            )
            query.reply(self._keys.param(echo.name), messages.encode(readback), encoding=self._encoding)

    def _set(self, query: zenoh.Query, changes: dict[str, float], *, single: bool) -> bool:
        reply = self._desk.set(changes, "zenoh")
        until = time.monotonic() + _ANSWER_PENDING_AFTER_S
        self._waiting.append(_Waiting(query, tuple(changes), single, reply.revision, until))
        return False

    def _settle(self) -> None:
        # Answer the sets that the servo has taken, and those that have waited long enough.
        if not self._waiting:
            return
        now = time.monotonic()
        live = self._desk.live_revision
        still: list[_Waiting] = []
        for waiting in self._waiting:
            taken = live >= waiting.revision
            if not taken and now < waiting.until:
                still.append(waiting)
                continue
            self._answer_set(waiting, self._desk.values() if taken else self._desk.accepted_values(), taken)
        self._waiting = still

    def _answer_set(self, waiting: _Waiting, values: dict[str, float], taken: bool) -> None:
        told = {n: values[n] for n in waiting.names if math.isfinite(values[n])}
        if len(told) < len(waiting.names):
            self._refuse(waiting.query, "accepted, but z_h0 has no meaning any more: k_hand is 0 N/m")
            return
        pending = not taken
        if waiting.single:
            name = waiting.names[0]
            key = self._keys.set_one(name)
            reply: messages.Message = messages.Readback(
                value=told[name], revision=waiting.revision, pending=pending
            )
        else:
            key = self._keys.set_many
            reply = messages.SetReply(values=told, revision=waiting.revision, pending=pending)
        waiting.query.reply(key, messages.encode(reply), encoding=self._encoding)
        waiting.query.drop()

    def _refuse(self, query: zenoh.Query, reason: str) -> None:
        self.refused += 1
        query.reply_err(messages.encode(messages.RefusalReply(reason=reason)), encoding=self._encoding)
        query.drop()
