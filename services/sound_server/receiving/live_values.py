"""Passes the drum's live values from the rig's readbacks to the engine, and keeps them for the engine that follows it.

Readbacks arrive on a thread of their own, answers to questions on the drum's: a short lock guards both, never held
during a call to the network. The audio thread reads the result one number at a time, without a lock.
"""

import threading

from drumstick.drum.engine import Engine, set_live
from drumstick.drum.output.levels import settle_as_set
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
        self._values: dict[str, float] = {}  # heard so far
        self._revisions: dict[str, int] = {}
        self._engines: tuple[Engine, ...] = ()  # that which is struck, and the one before, which rings on

    def play_on(self, scene: Scene, engine: Engine) -> None:
        """Change this engine from now on, made of that scene."""
        with self._lock:
            self._rows = {name: row for name, row in table_of(scene).items() if row.effect == DRUM}
            self._engines = (engine,)
            self._values.clear()
            self._revisions.clear()

    def begin_with(self, engine: Engine) -> None:
        """Set this engine, of the same scene, as its drum is set: it has sounded nowhere yet. It may never sound."""
        with self._lock:
            self._set_all(engine)
            settle_as_set(engine.listening)

    def go_on_with(self, engine: Engine) -> None:
        """Change this engine, which sounds now, and the one before it, which rings on."""
        with self._lock:
            self._set_all(engine)  # what came since it began
            self._engines = (engine, *self._engines[:1])

    def _set_all(self, engine: Engine) -> None:
        for name, value in self._values.items():
            set_live(engine, name, value)

    def heard(self) -> dict[str, float]:
        """Values by wire name, of those that were heard of; a copy."""
        with self._lock:
            return dict(self._values)

    def begin_anew(self) -> None:
        """Forget what was heard of a servo that has gone: revisions count from its start."""
        with self._lock:
            self._revisions.clear()

    def take(self, name: str, payload: bytes) -> None:
        """One readback. Never raises for anything that a network can deliver."""
        try:
            with self._lock:
                row = self._rows.get(name)
                if row is None or not self._engines:
                    return
                readback = decode(payload, Readback)
                value = row.check(readback.value)
                if readback.revision >= self._revisions.get(name, readback.revision):
                    self._revisions[name] = readback.revision
                    self._values[name] = value
                    for engine in self._engines:
                        set_live(engine, name, value)
        except (ValueError, Refusal) as error:
            self._log_limited.warn(f"{name} ignored: {error}")
