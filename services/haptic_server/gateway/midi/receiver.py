"""Notes from a MIDI port as played strikes, pressure as chokes, what controllers ask for, programs as scenes, on a
thread of their own.

A port that is not there is awaited for ever.
"""

import logging
import threading
import time
from collections.abc import Callable
from typing import Protocol

from drumstick.scenes.table import Refusal
from haptic_server.gateway.midi.note_map import ChokeKeys, NoteMap, program_of, request_of
from haptic_server.gateway.played_strikes import MIDI, Player
from protocol.rate_limited_log import RateLimitedLog

_log = logging.getLogger("gateway")
_POLL_S = 0.25
_QUIET_S = 10.0
_JOIN_S = 2.0

Ask = Callable[[str, float, Callable[[str], None]], None]
AskProgram = Callable[[int], None]


class InputPort(Protocol):
    """Origin of the messages. Belongs to the receiver's thread, but for `close`."""

    @property
    def is_open(self) -> bool:
        """True while there is a port that is heard."""
        ...

    def poll(self, now_s: float) -> str:
        """See after the port and hand on what came. What there is to tell of it, "" if nothing."""
        ...

    def wait(self, timeout_s: float) -> None:
        """Sleep until there is something to poll for."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class MidiReceiver:
    """Receiver of one port; `take` is what the port hands its messages to.

    `ask` is given "rate", "level" or a parameter's name, its value, and what to call with the reason if it is refused
    later; `ask_program` a program, from 0.
    """

    def __init__(self, notes: NoteMap, player: Player, ask: Ask, ask_program: AskProgram) -> None:
        self._notes = notes
        self.play_scene(player, ask, ask_program)
        self._choke_keys = ChokeKeys()
        self._limited_log = RateLimitedLog(
            time.monotonic_ns, _QUIET_S, lambda line: _log.warning("midi: %s", line)
        )
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._port: InputPort | None = None

    def play_scene(self, player: Player, ask: Ask, ask_program: AskProgram) -> None:
        """Hand what comes from now on to these; any thread."""
        self._player, self._ask, self._ask_program = player, ask, ask_program

    def listen(self, port: InputPort) -> None:
        """Begin."""
        self._port = port
        self._thread = threading.Thread(target=self._run, args=(port,), name="midi in", daemon=True)
        self._thread.start()

    def take(self, message: bytes) -> None:
        """Play what a message stands for. The port's thread."""
        if asked := request_of(message, self._notes.channel):
            self._request(*asked)
            return
        program = program_of(message, self._notes.channel)
        if program is not None:
            self._change(program)
            return
        strike = self._notes.strike(message)
        try:
            if self._choke_keys.is_choke(message, self._notes.channel):
                self._player.choke(MIDI)
            elif strike is not None:
                self._player.play(strike.x, 0.0, strike.level, MIDI)
        except Refusal as refusal:
            self._limited_log.warn(f"a note was not played: {refusal}")

    def _request(self, name: str, value: float) -> None:
        def refused(why: str) -> None:
            self._limited_log.warn(f"a controller changed nothing: {why}")

        try:
            self._ask(name, value, refused)
        except Refusal as refusal:
            refused(str(refusal))

    def _change(self, program: int) -> None:
        try:
            self._ask_program(program)
        except Refusal as refusal:
            self._limited_log.warn(f"a program changed nothing: {refusal}")

    @property
    def counters(self) -> dict[str, int]:
        """Presence of the port; notes are counted where they are played."""
        return {"open": int(self._port is not None and self._port.is_open)}

    def close(self) -> None:
        """End; waits two seconds at most. Idempotent."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join(_JOIN_S)

    def _run(self, port: InputPort) -> None:
        try:
            while not self._closing.is_set():
                news = port.poll(time.monotonic())
                if news:
                    _log.warning("midi: %s", news)
                port.wait(_POLL_S)
        finally:
            port.close()
