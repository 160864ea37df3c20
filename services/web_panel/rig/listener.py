"""Keeps a RigState true: subscriptions for what the rig publishes, queries for what was said before we came.

It recovers by itself: a new start of the servo (`boot`), a silence, or a revision that no readback explains makes it
ask again.
"""

from __future__ import annotations

import json
import logging
import math
import time
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
import zenoh

from drumstick.safety.envelope import Limits
from drumstick.scenes.scene_text import SceneError, from_tables
from drumstick.scenes.table import table_of
from protocol.foreign_text import shown
from protocol.keys import Keys
from protocol.messages import Lease, Message, Meter, PresetNews, Readback, State, decode
from protocol.rate_limited_log import RateLimitedLog
from web_panel.rig.query import RepeatedQuery
from web_panel.rig.rig_state import SILENT_AFTER_S, RigState
from web_panel.rig.view_subscriptions import ViewSubscriptions

_log = logging.getLogger("panel")
_M = TypeVar("_M", bound=Message)
_READBACKS_AGAIN_S = 0.5
_QUIET_S = 10.0
_MAX_PRESENT = 1000  # tokens; anybody who may declare them could make up any number
# Rings: a full queue of one subscription would stop every other one of the session.
_DEPTH = 256


class _PresetRow(msgspec.Struct):
    name: str


class _Health(msgspec.Struct):
    limits: Limits | None = None  # a number that is left out has no limit


class Listener:
    """Subscriptions of one session. Made by any thread; `poll` belongs to the main thread."""

    def __init__(self, session: zenoh.Session, keys: Keys, rig_state: RigState) -> None:
        self._session = session
        self._keys = keys
        self._rig_state = rig_state
        self._subscribers = {
            key: session.declare_subscriber(key, zenoh.handlers.RingChannel(_DEPTH))
            for key in (
                keys.state,
                keys.meter,
                keys.param("*"),
                keys.play_rate,
                keys.play_level,
                keys.preset,
                keys.lease,
            )
        }
        self._present = session.liveliness().declare_subscriber(
            keys.alive("*", "*"), zenoh.handlers.RingChannel(_DEPTH), history=True
        )
        self.watching = ViewSubscriptions(session, keys, rig_state, self._read)
        self._scene = RepeatedQuery(session, keys.scene, self._read_scene)
        self._readbacks = RepeatedQuery(session, keys.param("*"), self._read_readback, _READBACKS_AGAIN_S)
        self._presets = RepeatedQuery(session, keys.preset, self._read_presets)
        self._lease = RepeatedQuery(session, keys.lease, self._read_lease)
        self._limits = RepeatedQuery(session, keys.doctor, self._read_limits)
        self._revision_explained = -1
        self._log_limited = RateLimitedLog(
            time.monotonic_ns, _QUIET_S, lambda line: _log.warning("panel: %s", line)
        )

    def poll(self, now: float) -> None:
        """Take what has arrived and ask for what is missing. Never blocks."""
        rig_state = self._rig_state
        rig_state.connected = True
        self._take(self._keys.state, State, lambda _, state: self._take_state(state, now))
        self._take(self._keys.meter, Meter, lambda _, meter: rig_state.note_meter(meter, now))
        self._take(self._keys.param("*"), Readback, rig_state.note_readback)
        for key in (self._keys.play_rate, self._keys.play_level):
            self._take(key, Readback, self._take_roll)
        self._take(self._keys.preset, PresetNews, self._take_news)
        self._take(self._keys.lease, Lease, self._take_lease)
        self._take_tokens()
        self.watching.poll(now)
        self._scene.follow(now)
        if rig_state.scene is not None:
            for asking in (self._readbacks, self._presets, self._lease, self._limits):
                asking.follow(now)
            if rig_state.state is not None and self._missed(rig_state.state):
                self.check_again()

    def check_again(self) -> None:
        """Ask for all readbacks soon."""
        self._readbacks.stale = True

    def _take(self, key: str, kind: type[_M], note: Callable[[str, _M], None]) -> None:
        while (sample := self._subscribers[key].try_recv()) is not None:
            self._read(sample, kind, note)

    def _read(self, sample: zenoh.Sample, kind: type[_M], note: Callable[[str, _M], None]) -> bool:
        key = str(sample.key_expr)
        try:
            note(key.rpartition("/")[2], decode(sample.payload.to_bytes(), kind))
        except ValueError as error:
            self._warn(key, str(error))
            return False
        return True

    def _warn(self, key: str, words: str) -> None:
        # Not once for each key: who publishes rubbish also makes up any number of keys.
        self._log_limited.warn(f"{key}: {words}")

    def _take_state(self, state: State, now: float) -> None:
        rig_state = self._rig_state
        if (
            rig_state.state is None
            or state.boot != rig_state.state.boot
            or now - rig_state.state_at > SILENT_AFTER_S
        ):
            for asking in (self._scene, self._readbacks, self._presets, self._lease, self._limits):
                asking.ask_at_once()
            self._revision_explained = -1
            rig_state.readbacks.clear()  # a new start counts revisions from 0 again
            rig_state.setpoints.clear()
            rig_state.roll.clear()
        rig_state.note_state(state, now)

    def _take_tokens(self) -> None:
        rig_state = self._rig_state
        while (sample := self._present.try_recv()) is not None:
            *_, service, instance = str(sample.key_expr).split("/")
            for names in (
                (rig_state.present, rig_state.pointed) if service == "pointer" else (rig_state.present,)
            ):
                here = sample.kind == zenoh.SampleKind.PUT
                name = shown(f"{service}/{instance}")
                if not here:
                    names.discard(name)
                elif len(names) < _MAX_PRESENT:
                    names.add(name)

    def _take_roll(self, name: str, told: Readback) -> None:
        self._rig_state.roll[name] = told.value

    def _take_news(self, _: str, news: PresetNews) -> None:
        self._presets.stale = True

    def _take_lease(self, _: str, lease: Lease) -> None:
        self._rig_state.lease_of = lease.name

    def _read_readback(self, sample: zenoh.Sample) -> bool:
        return self._read(sample, Readback, self._rig_state.note_readback)

    def _read_lease(self, sample: zenoh.Sample) -> bool:
        return self._read(sample, Lease, self._take_lease)

    def _read_presets(self, sample: zenoh.Sample) -> bool:
        try:
            rows = msgspec.json.decode(sample.payload.to_bytes(), type=list[_PresetRow])
        except (msgspec.MsgspecError, UnicodeDecodeError) as error:
            self._warn(str(sample.key_expr), f"the presets cannot be read: {error}")
            return False
        self._rig_state.presets = tuple(row.name for row in rows)
        return True

    def _read_limits(self, sample: zenoh.Sample) -> bool:
        try:
            limits = msgspec.json.decode(sample.payload.to_bytes(), type=_Health).limits
        except (msgspec.MsgspecError, UnicodeDecodeError) as error:
            self._warn(str(sample.key_expr), f"the limits cannot be read: {error}")
            return False
        known = vars(limits) if limits is not None else {}
        self._rig_state.limits = {name: value for name, value in known.items() if math.isfinite(value)}
        return True

    def _read_scene(self, sample: zenoh.Sample) -> bool:
        try:
            tables: Any = json.loads(sample.payload.to_bytes())
            scene = from_tables(tables)
        except (ValueError, SceneError, AttributeError) as error:
            self._warn(str(sample.key_expr), f"the scene cannot be read: {error}")
            return False
        self._rig_state.note_scene(scene, table_of(scene))
        return True

    def _missed(self, state: State) -> bool:
        # A publication can get lost, and then only State tells that there is more to know.
        readbacks = self._rig_state.readbacks.values()
        if not state.pending and any(readback.pending for readback in readbacks):
            return True
        newest = max((readback.revision for readback in readbacks), default=-1)
        if state.revision <= max(newest, self._revision_explained):
            return False
        self._revision_explained = state.revision
        return True
