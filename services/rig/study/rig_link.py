"""The rig as a study meets it, over Zenoh: strikes that are heard, clicks that are played, the clock.

`heard` is filled on Zenoh's threads; everything else is for one thread.
"""

import contextlib
import json
import logging
import queue
from collections.abc import Callable
from typing import Any

import msgspec
import zenoh

from protocol.clock import ClockMap, HapticClock, asked_clock
from protocol.foreign_text import shown
from protocol.keys import Keys
from protocol.messages import Meter, RefusalReply, Strike, decode
from realtime.log import say
from rig.exit_status import unavailable
from rig.study.task import Task

_NAME = "study metronome"
METRONOME = f"zenoh {_NAME}"  # source of a click's strike
_ANSWER_WITHIN_S = 2.0


class RigLink:
    """One rig, over a session that outlives it. Questions block for up to 2 s, and raise CommandError."""

    def __init__(self, session: Any, keys: Keys) -> None:
        self._session, self._keys = session, keys
        self._clock_map = ClockMap()
        self.heard: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._meters: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._subscribers = [
            session.declare_subscriber(keys.strike, _into(self.heard)),
            session.declare_subscriber(keys.meter, _into(self._meters)),
        ]

    def click(self, task: Task) -> int:
        """Play the task's click now; the instant of its strike, ns of the haptic machine's clock."""
        place = [task.click_x, task.click_y, task.click_level, _NAME]
        return decode(self._asked(self._keys.play_strike, msgspec.msgpack.encode([1, place])), Strike).t_ns

    def clock(self) -> HapticClock:
        """The haptic machine's clock against ours."""
        found = asked_clock(self._clock_map, lambda: self._asked(self._keys.clock), _warn)
        if found is None:
            unavailable(f"the rig {self._keys.rig!r} answers nonsense when asked for its clock")
        return found

    def scene(self) -> str:
        """Name of the scene that the rig plays."""
        tables: Any = json.loads(self._asked(self._keys.scene))
        return shown(tables["name"])

    def meter(self) -> Meter | None:
        """The newest meter that a sound server published; None without one."""
        newest = None
        while not self._meters.empty():
            with contextlib.suppress(ValueError):  # of another version: it is told where meters are shown
                newest = decode(self._meters.get(), Meter)
        return newest

    def _asked(self, key: str, payload: bytes | None = None) -> bytes:
        try:
            for reply in self._session.get(key, payload=payload, timeout=_ANSWER_WITHIN_S):
                if reply.ok is not None:
                    return reply.ok.payload.to_bytes()
                refusal = decode(reply.err.payload.to_bytes(), RefusalReply)
                unavailable(f"{key} was refused: {shown(refusal.reason)}")
        except zenoh.ZError as error:
            unavailable(f"{key}: {error}")
        unavailable(f"nobody answers {key}: is a rig of that name running? (--rig, --connect)")


def _into(waiting: queue.SimpleQueue[bytes]) -> Callable[[zenoh.Sample], None]:
    return lambda sample: waiting.put(sample.payload.to_bytes())


def _warn(words: str) -> None:
    say(logging.WARNING, f"study: {words}")
