"""Subscriptions held only while somebody looks. The sound server publishes such things only while somebody subscribes.

Main thread; never blocks.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import zenoh

from protocol.announced import Announcements
from protocol.messages import Cost, Membrane, Message, Release, Spectrum, Strike
from web_panel.rig.query import Query
from web_panel.rig.rig_state import METER_LIFE_S
from web_panel.rig.spectrum_data import levels_of
from web_panel.rig.surface_mesh import heights_of

if TYPE_CHECKING:
    from protocol.keys import Keys
    from web_panel.rig.rig_state import RigState

STRIKES, RELEASES, DOCTOR = "strikes", "releases", "doctor"
MEMBRANE, SPECTRUM, COST = "membrane", "spectrum", "cost"
_DOCTOR_EVERY_S = 2.0
_DEPTH = 64
_MAX_COSTS = 8

Read = Callable[[zenoh.Sample, type[Any], Callable[[str, Any], None]], bool]


class ViewSubscriptions:
    """Optional subscriptions of one session. `want` says what is looked at; `read` decodes a sample and hands it on.

    Surface, spectrum and costs come at least once a second; like meters, those of long ago are forgotten.
    """

    def __init__(self, session: zenoh.Session, keys: Keys, rig_state: RigState, read: Read) -> None:
        self._session, self._rig_state, self._read = session, rig_state, read
        self._doctor_key = keys.doctor
        self._sources: dict[str, tuple[str, type[Message], Callable[[str, Any], None]]] = {
            STRIKES: (keys.strike, Strike, lambda _, strike: rig_state.note_strike(strike, self._now)),
            RELEASES: (keys.release, Release, lambda _, release: rig_state.note_release(release, self._now)),
            MEMBRANE: (keys.membrane, Membrane, self._note(MEMBRANE, heights_of)),
            SPECTRUM: (keys.spectrum, Spectrum, self._note(SPECTRUM, levels_of)),
            COST: (keys.cost, Cost, lambda _, cost: self._note_cost(cost)),
        }
        self._received_at: dict[str, float] = {}  # by the sound server
        self._now = 0.0
        self._subscribers: dict[str, zenoh.Subscriber[Any]] = {}
        self._doctor_wanted = False
        self._doctor: Query | None = None
        self._doctor_asked_at = float("-inf")

    def _note(self, name: str, read: Callable[[Any], object]) -> Callable[[str, Any], None]:
        # Of several sound servers the first by id is shown. What cannot be read is refused here, not in the picture.
        def note(_: str, message: Any) -> None:
            read(message)
            if message.id == min(self._rig_state.meters, default=message.id):
                setattr(self._rig_state, name, message)
                self._received_at[name] = self._now

        return note

    def _note_cost(self, cost: Cost) -> None:
        costs = self._rig_state.costs
        if cost.id == min(self._rig_state.meters, default=cost.id) and (
            cost.accuracy in costs or len(costs) < _MAX_COSTS
        ):
            costs[cost.accuracy] = cost
            self._received_at[COST] = self._now

    def want(self, wanted: frozenset[str]) -> None:
        """Subscribe to what is looked at now, and to nothing else."""
        self._doctor_wanted = DOCTOR in wanted
        for name, (key, _, _) in self._sources.items():
            if name in wanted and name not in self._subscribers:
                self._subscribers[name] = self._session.declare_subscriber(
                    key, zenoh.handlers.RingChannel(_DEPTH)
                )
            elif name not in wanted and name in self._subscribers:
                self._subscribers.pop(name).undeclare()
                self._forget(name)

    def _forget(self, name: str) -> None:
        self._received_at.pop(name, None)
        if name in (MEMBRANE, SPECTRUM):
            setattr(self._rig_state, name, None)
        elif name == COST:
            self._rig_state.costs.clear()
        elif name == RELEASES:
            self._rig_state.announcements = Announcements()

    def poll(self, now: float) -> None:
        """Take what has arrived, and ask again for what must be asked for."""
        self._now = now
        for name, subscriber in self._subscribers.items():
            _, kind, note = self._sources[name]
            while (sample := subscriber.try_recv()) is not None:
                self._read(sample, kind, note)
        for gone in [name for name, at in self._received_at.items() if now - at > METER_LIFE_S]:
            self._forget(gone)
        self._follow_doctor(now)

    def _follow_doctor(self, now: float) -> None:
        if self._doctor is not None and self._doctor.ended():
            self._rig_state.doctor = _newest_object(self._doctor.heard)
            self._doctor = None
        if self._doctor_wanted and self._doctor is None and now - self._doctor_asked_at >= _DOCTOR_EVERY_S:
            self._doctor = Query(self._session, self._doctor_key)
            self._doctor_asked_at = now


def _newest_object(heard: list[zenoh.Sample]) -> dict[str, Any] | None:
    # The first answer that is a JSON object.
    for sample in heard:
        try:
            found: object = json.loads(sample.payload.to_bytes())
        except (ValueError, RecursionError):
            continue
        if isinstance(found, dict):
            return cast(dict[str, Any], found)
    return None
