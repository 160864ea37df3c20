"""Discovery of the rigs on a network of routers: their tokens, newest states, and answer times."""

from __future__ import annotations

import json
import queue
import time
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import zenoh

from protocol.keys import Keys
from protocol.messages import State, decode
from protocol.pattern import alive_key, presence_of

_POLL_S = 0.5
_TRIPS = 3
_STATE_WITHIN_S = 0.5  # told 30 times a second
_STALE_S = 2.0
SILENT, NO_SERVER = "does not answer", "no haptic server"


class Seen(NamedTuple):
    """One rig. None: not known, because nobody of it answered."""

    rig: str
    scene: str | None
    state: str  # as in State.status, or SILENT, or NO_SERVER
    strikes: int | None
    roll_rate_Hz: float | None
    round_trip_ms: float | None  # the shortest of three, to the haptic server and back
    services: dict[str, int]  # how many of each kind are present: haptic, sound, panel, record, pointer


class _Heard(NamedTuple):
    state: State
    at: float


class Network:
    """Seen from one session, which its owner closes. One thread; `look` takes half a second where some rig is silent,
    and a few round trips where none is."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._states: dict[str, Any] = {}
        self._heard: dict[str, _Heard] = {}

    def poll(self) -> list[Seen]:
        """Every rig of which some service is present, by name."""
        services = self._present()
        served = [rig for rig, there in services.items() if there["haptic"]]
        self._follow(served)
        answers = self._ask(served)
        self._subscribe(served)
        return [self._seen(rig, services[rig], answers.get(rig)) for rig in sorted(services)]

    def _present(self) -> dict[str, Counter[str]]:
        found: dict[str, Counter[str]] = {}
        keys = {
            str(reply.ok.key_expr)
            for reply in self._session.liveliness().get(alive_key(), timeout=_POLL_S)
            if reply.ok is not None
        }
        for key in keys:
            presence = presence_of(key)
            if presence is not None:
                found.setdefault(presence.rig, Counter())[presence.service] += 1
        return found

    def _follow(self, rigs: Sequence[str]) -> None:
        for rig in rigs:
            if rig not in self._states:
                self._states[rig] = self._session.declare_subscriber(
                    Keys(rig).state, zenoh.handlers.RingChannel(1)
                )
        for rig in [rig for rig in self._states if rig not in rigs]:
            self._states.pop(rig).undeclare()
            self._heard.pop(rig, None)

    def _subscribe(self, rigs: Sequence[str]) -> None:
        end = time.monotonic() + _STATE_WITHIN_S
        while True:
            for rig in rigs:
                while (sample := self._states[rig].try_recv()) is not None:
                    self._note(rig, sample)
            now = time.monotonic()
            if now >= end or all(rig in self._heard and now - self._heard[rig].at < _STALE_S for rig in rigs):
                return
            time.sleep(0.01)

    def _note(self, rig: str, sample: Any) -> None:
        try:
            self._heard[rig] = _Heard(decode(sample.payload.to_bytes(), State), time.monotonic())
        except ValueError:
            return  # a foreign program's; the rig is shown as silent if it says nothing itself

    def _ask(self, rigs: Sequence[str]) -> dict[str, tuple[str | None, float]]:
        # The scene's name and the shortest round trip of each that answers; all are asked at once.
        found: dict[str, tuple[str | None, float]] = {}
        asked = list(rigs)
        for _ in range(_TRIPS):
            for rig, (name, trip_s) in self._trip(asked).items():
                before = found.get(rig, (None, trip_s))
                found[rig] = (name or before[0], min(trip_s, before[1]))
            asked = [rig for rig in asked if rig in found]
        return found

    def _trip(self, rigs: Sequence[str]) -> dict[str, tuple[str | None, float]]:
        came: queue.SimpleQueue[tuple[str, bytes | None, float]] = queue.SimpleQueue()
        sent: dict[str, float] = {}
        for rig in rigs:

            def take(reply: zenoh.Reply, rig: str = rig) -> None:
                payload = reply.ok.payload.to_bytes() if reply.ok is not None else b""
                came.put((rig, payload, time.monotonic()))

            def over(rig: str = rig) -> None:
                came.put((rig, None, 0.0))

            sent[rig] = time.monotonic()
            handler = zenoh.handlers.Callback(take, over, indirect=False)
            self._session.get(Keys(rig).scene, handler, timeout=_POLL_S)
        found: dict[str, tuple[str | None, float]] = {}
        for _ in rigs:
            while (item := came.get())[1] is not None:
                rig, payload, at = item
                found.setdefault(rig, (_name_in(payload), at - sent[rig]))
        return found

    def _seen(self, rig: str, there: Counter[str], answer: tuple[str | None, float] | None) -> Seen:
        services = dict(sorted(there.items()))
        if not there["haptic"]:
            return Seen(rig, None, NO_SERVER, None, None, None, services)
        heard = self._heard.get(rig)
        if heard is None or time.monotonic() - heard.at > _STALE_S:
            state, strikes, rate_Hz = SILENT, None, None
        else:
            state, strikes, rate_Hz = heard.state.status, heard.state.strikes, heard.state.roll_rate_Hz
        name, trip_s = answer or (None, None)
        trip_ms = None if trip_s is None else round(1e3 * trip_s, 3)
        return Seen(rig, name, state, strikes, rate_Hz, trip_ms, services)


def _name_in(payload: bytes | None) -> str | None:
    try:
        tables: object = json.loads(payload or b"")
    except (ValueError, RecursionError):
        return None
    name = cast(dict[str, object], tables).get("name") if isinstance(tables, dict) else None
    return name if isinstance(name, str) else None
