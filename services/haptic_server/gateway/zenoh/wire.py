"""The gateway's Zenoh side: publishes what the servo does, answers queries, takes sets.

`put_*` are for the relay thread. Queries arrive on zenoh's threads, which only queue them; one worker answers, and
another one those that wait for the disk. Only a panic is raised where it arrives. A set is answered when the servo uses
it, or as pending after a while.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

from haptic_server.gateway.lease import LeaseHolder
from haptic_server.gateway.presets import Presets
from haptic_server.gateway.scenes.ahead import SceneAhead
from haptic_server.gateway.scenes.requests import SceneRequests
from haptic_server.gateway.settings import Parameters, ReadbackValue
from haptic_server.gateway.zenoh.backlog import Backlog
from protocol import messages
from protocol.keys import Keys
from protocol.query_thread import Questions, payload_of, refuse
from protocol.queryables import Queryables
from protocol.requests import Claim, requested_names, requested_text, requested_value, requested_values

if TYPE_CHECKING:
    import zenoh

_ANSWER_PENDING_AFTER_S = 0.15
_NEXT = "next"  # parameter of a query for the scene that is made ready


class _Waiting(NamedTuple):
    # `reply` makes the answer of values and of whether they still wait; `key` is where it goes.
    query: zenoh.Query
    names: tuple[str, ...]
    key: str
    reply: Callable[[dict[str, float], bool], messages.Message]
    parameters: Parameters
    revision: int
    until: float


class Wire:
    """Keys of one rig on one Zenoh session."""

    def __init__(
        self,
        session: zenoh.Session,
        keys: Keys,
        parameters: Parameters,
        boot: Callable[[], int],
        scene_json: str,
        health: Callable[[], Mapping[str, object]],
        presets: Presets,
        scenes: SceneRequests,
    ) -> None:
        import zenoh

        self._session = session
        self._keys = keys
        self._parameters = parameters
        self._boot = boot
        self._scene_json = scene_json
        self._health = health
        self._encoding = zenoh.Encoding(messages.ENCODING)
        self._json = zenoh.Encoding.APPLICATION_JSON
        self._presets = presets
        self._scenes = scenes
        self.ahead: SceneAhead | None = None
        self._waiting: list[_Waiting] = []
        self._strike = session.declare_publisher(keys.strike, encoding=self._encoding)
        self._choke = session.declare_publisher(keys.choke, encoding=self._encoding)
        self._release = session.declare_publisher(keys.release, encoding=self._encoding)
        self._state = session.declare_publisher(keys.state, encoding=self._encoding)
        self._backlog = Backlog(self._strike)
        self._questions = Questions("queries", self._answer, self._settle)
        self._writes = Questions("preset files", self._write_preset)
        self.queryables = Queryables(session)
        # A panic is heard first of all; `clock`, by which others know that a gateway is there, is answered last.
        self.queryables.declare_writing(keys.panic, self._panic)
        for key in (keys.set_many, keys.set_one("*"), keys.scene_load, keys.lease, keys.preset_load):
            self.queryables.declare_writing(key, self._questions.receive)
        for key in (keys.preset_save, keys.preset_rename, keys.preset_delete):
            self.queryables.declare_writing(key, self._writes.receive)
        for key in (keys.param("*"), keys.scene, keys.doctor, keys.preset, keys.clock):
            self.queryables.declare_reading(key, self._questions.receive)
        self._token = session.liveliness().declare_token(keys.alive("haptic", f"{boot():x}"))

    def play_scene(
        self, parameters: Parameters, scene_json: str, presets: Presets, scenes: SceneRequests
    ) -> None:
        """Answer for another scene and its servo from now on. No key falls silent meanwhile."""
        self._parameters, self._presets, self._scenes = parameters, presets, scenes
        self._scene_json = scene_json
        self._token.undeclare()
        self._token = self._session.liveliness().declare_token(
            self._keys.alive("haptic", f"{self._boot():x}")
        )

    @property
    def refused(self) -> int:
        """Queries that were refused, for whatever reason."""
        return self._questions.refused + self._writes.refused + self.queryables.refused

    def put_strike(self, strike: messages.Strike) -> None:
        """Publish one strike."""
        self._backlog.put(self._strike, messages.encode(strike))

    def put_played(self, strike: messages.Strike) -> None:
        """Publish a played strike at once, whoever listens yet; any thread."""
        self._strike.put(messages.encode(strike))

    def put_choke(self, choke: messages.Choke) -> None:
        """Publish a choke at once; any thread."""
        self._choke.put(messages.encode(choke))

    def put_release(self, release: messages.Release) -> None:
        """Publish one release."""
        self._backlog.put(self._release, messages.encode(release))

    @property
    def holds_back(self) -> bool:
        """True while messages wait for subscribers that are not back yet."""
        return not self._backlog.is_over

    def step(self, now_ns: int) -> None:
        """Publish what was held for subscribers that were not back yet."""
        self._backlog.step(now_ns * 1e-9)

    def put_state(self, state: messages.State) -> None:
        """Publish how the servo stands."""
        self._state.put(messages.encode(state))

    def put_readbacks(self, echoes: list[ReadbackValue], revision: int, pending: bool) -> None:
        """Publish readbacks."""
        for echo in echoes:
            readback = messages.Readback(value=echo.value, revision=revision, pending=pending)
            self._session.put(self._keys.param(echo.name), messages.encode(readback), encoding=self._encoding)

    def put_lease(self, holder: LeaseHolder) -> None:
        """Publish who alone may set."""
        payload = messages.encode(messages.Lease(name=holder.name, left_s=holder.left_s))
        self._session.put(self._keys.lease, payload, encoding=self._encoding)

    def put_news(self, news: messages.PresetNews) -> None:
        """Publish what became of a preset; any thread."""
        self._session.put(self._keys.preset, messages.encode(news), encoding=self._encoding)

    def close(self) -> None:
        """Stop answering. The caller closes the session."""
        self._questions.close()
        self._writes.close()

    def _panic(self, query: zenoh.Query) -> None:
        # At once, on zenoh's own thread: no queue stands before zero force.
        self._parameters.panic("zenoh")
        self._questions.receive(query)

    def _answer(self, query: zenoh.Query) -> bool:
        """Answer now, or remember a set until the servo took it; True when the query is done with."""
        key = str(query.key_expr)
        keys = self._keys
        payload = payload_of(query)
        if key == keys.set_many:
            changes, claim = requested_values(payload)
            return self._set(query, changes, claim, key)
        if key.startswith(keys.set_one("")):
            value, claim = requested_value(payload)
            return self._set(query, {key.removeprefix(keys.set_one("")): value}, claim, key)
        if key == keys.preset_load:
            return self._load(query, *requested_text(payload))
        if key == keys.scene_load:
            self._load_scene(query, *requested_text(payload))
        elif key.startswith(keys.param("")):
            self._ask(query, key.removeprefix(keys.param("")))
        elif key == keys.scene:
            query.reply(keys.scene, self._scene_of(query), encoding=self._json)
        elif key == keys.clock:
            clock = messages.Clock(boot=self._boot(), t_ns=time.monotonic_ns())
            query.reply(keys.clock, messages.encode(clock), encoding=self._encoding)
        elif key == keys.doctor:
            query.reply(keys.doctor, json.dumps(self._health()), encoding=self._json)
        elif key == keys.panic:  # raised already
            query.reply(keys.panic, messages.encode(messages.Message()), encoding=self._encoding)
        elif key == keys.lease:
            query.reply(keys.lease, messages.encode(self._lease(payload)), encoding=self._encoding)
        elif key == keys.preset:
            listed = [row._asdict() for row in self._presets.list()]
            query.reply(keys.preset, json.dumps(listed), encoding=self._json)
        else:
            raise ValueError(f"{key}: name one key; wildcards are for param/* only")
        return True

    def _scene_of(self, query: zenoh.Query) -> str:
        if str(query.parameters) != _NEXT:
            return self._scene_json
        if self.ahead is None or self.ahead.tables is None:
            raise ValueError("scene: no other scene is being prepared")
        return json.dumps(self.ahead.tables)

    def _lease(self, payload: bytes) -> messages.Lease:
        if payload:
            asked = messages.decode(payload, messages.LeaseRequest)
            holder = self._parameters.take_lease(asked.who, asked.name, asked.seconds)
        else:
            holder = self._parameters.lease_holder()
        return messages.Lease(name=holder.name, left_s=holder.left_s)

    def _load_scene(self, query: zenoh.Query, name: str, claim: Claim) -> None:
        self._scenes.ask_for(name, claim)
        query.reply(self._keys.scene_load, messages.encode(messages.Message()), encoding=self._encoding)

    def _write_preset(self, query: zenoh.Query) -> bool:
        key, payload = str(query.key_expr), payload_of(query)
        if key == self._keys.preset_rename:
            name, new, claim = requested_names(payload)
            news = self._presets.rename(name, new, "zenoh", claim)
        elif key == self._keys.preset_delete:
            name, claim = requested_text(payload)
            news = self._presets.delete(name, "zenoh", claim)
        else:
            name, _ = requested_text(payload)
            news = messages.PresetNews(what="saved", name=self._presets.save(name, "zenoh").name)
        query.reply(key, messages.encode(news), encoding=self._encoding)
        return True

    def _ask(self, query: zenoh.Query, name: str) -> None:
        known, revision = self._parameters.everything()
        echoes = [echo for echo in known if name in ("*", "**", echo.name)]
        if not echoes:
            raise ValueError(
                f"{name}: no such parameter in this scene; it has {', '.join(self._parameters.table)}"
            )
        for echo in echoes:
            readback = messages.Readback(
                value=echo.value, revision=revision, pending=self._parameters.pending
            )
            query.reply(self._keys.param(echo.name), messages.encode(readback), encoding=self._encoding)

    def _set(self, query: zenoh.Query, changes: dict[str, float], claim: Claim, key: str) -> bool:
        parameters = self._parameters  # of one scene throughout: another may take its place meanwhile
        taken = parameters.set(changes, "zenoh", claim)

        def reply(values: dict[str, float], pending: bool) -> messages.Message:
            if key == self._keys.set_many:
                return messages.SetReply(values=values, revision=taken.revision, pending=pending)
            (value,) = values.values()
            return messages.Readback(value=value, revision=taken.revision, pending=pending)

        return self._answer_later(query, parameters, taken, key, reply)

    def _load(self, query: zenoh.Query, name: str, claim: Claim) -> bool:
        presets = self._presets
        taken, note = presets.load(name, "zenoh", claim)

        def reply(values: dict[str, float], pending: bool) -> messages.Message:
            return messages.PresetReply(
                name=name, values=values, revision=taken.revision, pending=pending, note=note
            )

        return self._answer_later(query, presets.parameters, taken, self._keys.preset_load, reply)

    def _answer_later(
        self,
        query: zenoh.Query,
        parameters: Parameters,
        taken: messages.SetReply,
        key: str,
        reply: Callable[[dict[str, float], bool], messages.Message],
    ) -> bool:
        until = time.monotonic() + _ANSWER_PENDING_AFTER_S
        self._waiting.append(
            _Waiting(query, tuple(taken.values), key, reply, parameters, taken.revision, until)
        )
        return False

    def _settle(self) -> bool:
        # Answer the sets that the servo has taken, and those that have waited long enough; True while some wait.
        if not self._waiting:
            return False
        now = time.monotonic()
        parameters = self._parameters
        live = parameters.live_revision
        still: list[_Waiting] = []
        for waiting in self._waiting:
            if waiting.parameters is not parameters:
                refuse(waiting.query, "another scene plays now")
                continue
            taken = live >= waiting.revision
            if not taken and now < waiting.until:
                still.append(waiting)
                continue
            self._answer_set(waiting, parameters.values() if taken else parameters.accepted_values(), taken)
        self._waiting = still
        return bool(still)

    def _answer_set(self, waiting: _Waiting, values: dict[str, float], taken: bool) -> None:
        held = {n: values[n] for n in waiting.names if math.isfinite(values[n])}
        if len(held) < len(waiting.names):
            refuse(waiting.query, "accepted, but z_h0 has no meaning any more: k_hand is 0 N/m")
            return
        reply = messages.encode(waiting.reply(held, not taken))
        waiting.query.reply(waiting.key, reply, encoding=self._encoding)
        waiting.query.drop()
