"""The last good set: what was accepted is on disk within half a second, so that a power cut does not lose it.

`note` and `fault` belong to the relay thread and never wait; a thread of its own writes. A set that is followed by a
fault within its first five seconds is no good one: the one before it is written back, so that a rig which nobody
watches does not start into the same fault again.
"""

import logging
import threading
import time
from collections.abc import Callable, Mapping

from haptic_server import records
from haptic_server.presets.preset import Preset, PresetError
from haptic_server.presets.store import PresetStore

_log = logging.getLogger("gateway")
PROBATION_NS = 5_000_000_000
# The faults that parameters can bring about; a pulled plug says nothing about the set.
_OF_MOTION = (records.OUT_OF_BOUNDS, records.TOO_FAST, records.SELF_DRIVEN, records.FORCE_ERROR)
_SETTLE_S = 0.2  # a slider that is dragged sets thirty times a second
_WARN_EVERY_S = 60.0


class LastGood:
    """Keeps one scene's last good set in a store. `preset_of` makes a preset of values."""

    def __init__(
        self,
        store: PresetStore,
        preset_of: Callable[[Mapping[str, float]], Preset],
        values: Mapping[str, float],
    ) -> None:
        """`values`: what holds now and counts as good. Not written: something older may be kept, for `--fresh`."""
        self._store = store
        self._preset_of = preset_of
        self._good = dict(values)
        self._newest: dict[str, float] | None = None  # nobody has set anything yet
        self._written: dict[str, float] | None = None
        self._since_ns = -PROBATION_NS
        self._fault = records.NO_FAULT
        self._said_s = -_WARN_EVERY_S
        self._wanted = threading.Event()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._keep, name="last good set", daemon=True)
        self._thread.start()

    def note(self, values: Mapping[str, float], now_ns: int) -> None:
        """The servo uses these values since `now_ns`."""
        if self._newest is not None and now_ns - self._since_ns >= PROBATION_NS:
            self._good = self._newest
        self._newest, self._since_ns = dict(values), now_ns
        self._wanted.set()

    def fault(self, kind: int, now_ns: int) -> None:
        """Take the servo's status, as often as it is known; a fault counts when it comes, not while it lasts."""
        came, self._fault = kind != self._fault, kind
        if not came or kind not in _OF_MOTION:
            return
        if self._newest is None or self._newest == self._good:
            return
        if now_ns - self._since_ns < PROBATION_NS:
            _log.warning("a fault soon after a set: the next start uses the set before it")
            self._newest = self._good
            self._wanted.set()

    def close(self) -> None:
        """Write what is not written yet; waits for the disk."""
        self._closing.set()
        self._wanted.set()
        self._thread.join()

    def _keep(self) -> None:
        while not self._closing.is_set():
            self._wanted.wait()
            self._wanted.clear()
            self._write()
            self._closing.wait(_SETTLE_S)
        self._write()

    def _write(self) -> None:
        values = self._newest
        if values is None or values == self._written:
            return
        try:
            self._store.save_last(self._preset_of(values))
        except PresetError as error:
            now_s = time.monotonic()
            if now_s - self._said_s >= _WARN_EVERY_S:
                self._said_s = now_s
                _log.error("the last good set is not kept: %s", error)
            self._wanted.set()  # again after a while: the disk may have room then
            self._closing.wait(1.0)
        else:
            self._written = values
