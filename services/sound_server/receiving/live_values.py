"""Passes the drum's live values from the rig's readbacks to the engine.

Readbacks arrive on a thread of their own, answers to questions on the drum's: a short lock guards both, never held
during a call to the network. The audio thread reads the result one number at a time, without a lock.
"""

import threading

from drumstick.drum.engine import Engine, set_live
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Parameter, Refusal, table_of
from drumstick.stick.law import DRUM
from protocol.messages import Readback, decode
from protocol.rate_limited_log import RateLimitedLog


class LiveValues:
    """Live values of one drum. A readback older than one that was heard before changes nothing."""

    def __init__(self, limited_log: RateLimitedLog) -> None:
        self._log_limited = limited_log
        self._lock = threading.Lock()
        self._rows: dict[str, Parameter] = {}
        self._revisions: dict[str, int] = {}
        self._engine: Engine | None = None

    def play_on(self, scene: Scene, engine: Engine) -> None:
        """Change this engine from now on, made of that scene."""
        with self._lock:
            self._rows = {name: row for name, row in table_of(scene).items() if row.effect == DRUM}
            self._engine = engine
            self._revisions.clear()

    def begin_anew(self) -> None:
        """Forget what was heard of a servo that has gone: revisions count from its start."""
        with self._lock:
            self._revisions.clear()

    def take(self, name: str, payload: bytes) -> None:
        """One readback. Never raises for anything that a network can deliver."""
        try:
            with self._lock:
                row = self._rows.get(name)
                if row is None or self._engine is None:
                    return
                readback = decode(payload, Readback)
                value = row.check(readback.value)
                if readback.revision >= self._revisions.get(name, readback.revision):
                    self._revisions[name] = readback.revision
                    set_live(self._engine, name, value)
        except (ValueError, Refusal) as error:
            self._log_limited.warn(f"{name} ignored: {error}")
