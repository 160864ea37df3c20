"""Strikes to a MIDI port, on a thread of their own: the relay only puts them into a queue that drops its oldest.

A port that is not there is announced once, and awaited for ever; what is struck meanwhile is not played later.
"""

import logging
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

from haptic_server.gateway.midi.encoding import X_CONTROLLER, Y_CONTROLLER, Voice
from protocol.messages import Strike

_log = logging.getLogger("gateway")
MAX_QUEUED = 256
LATE_S = 0.05  # a note that could not be sent for so long is not sent any more
_POLL_S = 0.25
_JOIN_S = 2.0
_SILENT_STATES = ("panic", "fault")


class Port(Protocol):
    """Destination of the messages. Belongs to the sender's thread; nothing may block for long."""

    @property
    def is_open(self) -> bool:
        """True when `send` reaches anything now."""
        ...

    def poll(self, now_s: float) -> str:
        """See after the port. What there is to tell of it, "" if nothing has changed since the last call."""
        ...

    def send(self, messages: bytes) -> bool:
        """Send whole messages; False when the port is gone."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class _Event(NamedTuple):
    queued_s: float
    strike: Strike | None  # None: the stick left the head


class MidiSender:
    """Sender to one port. `strike`, `release` and `status` never wait; `now` gives seconds and stands for the clock."""

    def __init__(self, voice: Voice, port: Port, now: Callable[[], float] = time.monotonic) -> None:
        self._voice = voice
        self._port = port
        self._now = now
        self._queue: deque[_Event] = deque(maxlen=MAX_QUEUED)
        self._changed = threading.Condition()
        self._is_silenced = self._must_silence = self._closing = False
        self._sounds = self._was_open = False
        self._controls: dict[int, bytes] = {}
        self._counts: Counter[str] = Counter()
        self._thread = threading.Thread(target=self._run, name="midi", daemon=True)
        self._thread.start()

    def strike(self, strike: Strike) -> None:
        """Begin a note. Any thread."""
        self._put(_Event(self._now(), strike))

    def release(self) -> None:
        """End it. Any thread."""
        self._put(_Event(self._now(), None))

    def status(self, words: str) -> None:
        """Take the servo's status: a panic or a fault ends every note, once. The relay thread."""
        silent = words.startswith(_SILENT_STATES)
        if silent != self._is_silenced:
            self._is_silenced = silent
            if silent:
                with self._changed:
                    self._must_silence = True
                    self._changed.notify()

    @property
    def counters(self) -> dict[str, int]:
        """Notes sent, and what was dropped because the queue was full, too late or without a port; a copy."""
        return {"open": int(self._port.is_open), **self._counts}

    def close(self) -> None:
        """End every note and let go of the port; waits two seconds at most. Idempotent."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(_JOIN_S)

    def _put(self, event: _Event) -> None:
        with self._changed:
            if len(self._queue) == MAX_QUEUED:
                self._counts["dropped"] += 1  # the oldest; the newest release is always there
            self._queue.append(event)
            self._changed.notify()

    def _run(self) -> None:
        closing = False
        try:
            while not closing:
                self._poll()
                with self._changed:
                    self._changed.wait_for(
                        lambda: self._queue or self._must_silence or self._closing, timeout=_POLL_S
                    )
                    events = list(self._queue)
                    self._queue.clear()
                    silence, self._must_silence = self._must_silence, False
                    closing = self._closing
                for event in events:
                    self._play(event)
                if silence or closing:
                    self._silence()
        finally:
            self._port.close()

    def _poll(self) -> None:
        news = self._port.poll(self._now())
        if news:
            _log.warning("midi: %s", news)
        is_new = self._port.is_open and not self._was_open
        self._was_open = self._port.is_open
        if is_new:
            self._controls.clear()  # who listens now has not heard any of them
            self._sounds = False

    def _play(self, event: _Event) -> None:
        if not self._port.is_open:
            self._counts["away"] += 1
        elif event.strike is None:
            if self._sounds:
                self._send(self._voice.off())
                self._sounds = False
        elif self._now() - event.queued_s > LATE_S:
            self._counts["late"] += 1
        else:
            self._begin(event.strike)

    def _begin(self, strike: Strike) -> None:
        try:
            controls = {
                controller: self._voice.control(controller, place)
                for controller, place in ((X_CONTROLLER, strike.x), (Y_CONTROLLER, strike.y))
            }
            note = self._voice.on(strike.level)
        except ValueError as error:  # a number that is not finite must not reach an instrument
            if not self._counts["unsendable"]:
                _log.error("midi: strike %d cannot be sent: %s", strike.seq, error)
            self._counts["unsendable"] += 1
            return
        before = self._voice.off() if self._sounds else b""
        changed = [
            message for controller, message in controls.items() if self._controls.get(controller) != message
        ]
        if self._send(
            b"".join((before, *changed, note))
        ):  # the place first: a sampler chooses its sample by it
            self._controls = controls
            self._sounds = True
            self._counts["notes"] += 1

    def _silence(self) -> None:
        if self._port.is_open:
            self._send(self._voice.silence())
            self._sounds = False

    def _send(self, messages: bytes) -> bool:
        sent = self._port.send(messages)
        if not sent:
            self._counts["away"] += 1
        return sent
