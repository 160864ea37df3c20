"""Recording: listens to a rig and writes what it hears, until it is stopped, time is up or the disk takes no more.

The calling thread waits for the end and asks the rig for its clock; one thread hears each key, one writes the file.
"""

import json
import logging
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import SceneError, from_tables
from drumstick.scenes.table import table_of
from protocol.messages import STICK, Message, Meter, decode
from protocol.rate_limited_log import RateLimitedLog
from realtime.log import say
from realtime.stop import StopRequest
from rig.network.remote_rig import RemoteRig
from rig.recording import channels
from rig.recording.lost_messages import LostMessages
from rig.recording.mcap_writer import CLOCK_METADATA, SCENE_ATTACHMENT, McapWriter
from rig.recording.recorder_session import Appeared, Item, NewClock, NewScene, Received, RecorderSession
from rig.recording.times import TimeLine, wall_minus_monotonic_ns

_TURN_S = 0.1
_QUIET_S = 1.0  # between warnings
_CLOCK_EVERY_S = 10.0
_BOOT_EVERY_S = 0.5
_ASK_AGAIN_S = 0.2
_ANSWER_WITHIN_S = 2.0  # as for every command; a busy machine may need more than one question's time
_WAKE_S = 0.2  # of the writing thread, to end a chunk that is old enough


@dataclass
class Result:
    """Contents of a recording, and how it ended. `failure`: what the system said when it could not be written."""

    file: str
    duration_s: float = 0.0
    bytes: int = 0
    messages: dict[str, int] = field(default_factory=dict[str, int])
    lost: dict[str, int] = field(default_factory=dict[str, int])  # heard, but more than could be written
    missing: dict[str, int] = field(default_factory=dict[str, int])  # never came
    unreadable: int = 0
    end: str = "stopped"
    failure: str | None = None


_START_ONE = ": start one with `drumstick up`, or name it with --connect and --rig"


class NoRig(Exception):
    """No rig answers; the text says where, or why, and what to do."""


class NoForce(Exception):
    """The forces were asked for, of a scene that does not stream them."""


def _facts(rig: str, force: bool, line: TimeLine) -> dict[str, str]:
    clock = line.clock
    assert clock is not None
    start_ns = time.monotonic_ns()
    return {
        "rig": rig,
        "force": str(force).lower(),
        "boot": str(clock.boot),
        "start_wall_ns": str(line.wall_ns(start_ns)),
        "start_monotonic_ns": str(start_ns),
        "wall_minus_monotonic_ns": str(line.offset_ns),
        "haptic_minus_monotonic_ns": str(clock.offset_ns),
        "clock_error_ns": str(clock.error_ns),
    }


def scene_of(payload: bytes) -> Scene:
    """The scene that the query answered. ValueError, worded."""
    try:
        tables: Any = json.loads(payload)
        if not isinstance(tables, dict):
            raise ValueError("the scene is no JSON object")
        return from_tables(cast(dict[str, Any], tables))
    except SceneError as error:
        raise ValueError(str(error.mistakes[0])) from None
    except RecursionError:
        raise ValueError("the scene is nested too deeply") from None


class Recorder:
    """Writes one file. `wait`: for a rig that is not there yet, and without insisting on a scene that streams."""

    def __init__(
        self,
        end: RemoteRig,
        out: Path,
        force: bool,
        wait: bool,
        say: Callable[[str], None],
    ) -> None:
        self._keys = end.keys
        self._endpoint = end.endpoint
        self._out = out
        self._force = force
        self._wait = wait
        self._say = say
        self._session = RecorderSession(end)
        self._line = TimeLine(wall_minus_monotonic_ns())
        self._lost = LostMessages()
        self._ended = threading.Event()
        self._boot = 0  # whose clock and scene the file has
        self._heard_boot = 0  # of the newest message; written by the writing thread
        self._scene = b""
        self._log_limited = RateLimitedLog(time.monotonic_ns, _QUIET_S, say)
        self.result = Result(str(out))

    def run(self, stop: StopRequest, duration_s: float | None = None) -> Result:
        """Record until `stop`, for `duration_s` at most, or until the file cannot be written any more.

        FileExistsError or another OSError: it could not be begun. NoRig, NoForce: there is nothing to record.
        """
        try:
            if not self._meet(stop):
                return self.result
            mcap = self._begin()
            writer = threading.Thread(target=self._write, args=(mcap,), name="recording", daemon=True)
            writer.start()
            begun = time.monotonic()
            try:
                self._attend(stop, writer, begun, duration_s)
            finally:
                self.result.duration_s = round(time.monotonic() - begun, 3)
                self._session.close()
                self._ended.set()
                writer.join()
            return self._result(mcap)
        finally:
            self._session.close()

    def _meet(self, stop: StopRequest) -> bool:
        # Until there is a rig that answers; what it does from now on is queued already. False: stopped before.
        if not self._session.open(stop, self._wait):
            if stop.is_set():
                return False
            raise NoRig(self._session.refused or f"no rig answers at {self._endpoint}{_START_ONE}")
        self._session.listen(self._force)
        given_up = time.monotonic() + _ANSWER_WITHIN_S
        while not stop.is_set():
            scene, clock = self._session.scene(), self._session.clock(self._warn)
            if scene is not None and clock is not None:
                self._scene, self._boot = scene, clock.boot
                self._line.learn(clock)
                return True
            if not self._wait and time.monotonic() >= given_up:
                raise NoRig(
                    f"nobody answers {self._keys.scene} and {self._keys.clock} at {self._endpoint}{_START_ONE}"
                )
            stop.wait(_ASK_AGAIN_S)
        return False

    def _begin(self) -> McapWriter:
        units: dict[str, str] = {}
        try:
            scene = scene_of(self._scene)
        except ValueError as error:
            self._warn(
                f"the rig's scene cannot be read here ({error}): parameters are recorded without units"
            )
        else:
            if self._force and scene.drum.excitation != "streamed" and not self._wait:
                raise NoForce(f"the scene {scene.name!r} does not stream its force")
            units = {name: row.quantity.unit for name, row in table_of(scene).items()}
        self._session.ask_params()
        facts = _facts(self._keys.rig, self._force, self._line)
        mcap = McapWriter(self._out, facts, lambda name: units.get(name, ""))
        try:
            mcap.attach_scene(SCENE_ATTACHMENT, self._scene, int(facts["start_wall_ns"]))
        except OSError:
            mcap.discard()
            raise
        return mcap

    def _attend(
        self, stop: StopRequest, writer: threading.Thread, begun: float, duration_s: float | None
    ) -> None:
        clock_at = begun + _CLOCK_EVERY_S
        boot_at = begun
        while not stop.wait(_TURN_S):
            now = time.monotonic()
            if not writer.is_alive():
                if self.result.failure is None:
                    raise RuntimeError("the writing thread ended; its traceback stands above")
                self.result.end = "the file could not be written any more"
                return
            if duration_s is not None and now - begun >= duration_s:
                self.result.end = "duration"
                return
            if self._heard_boot not in (0, self._boot) and now >= boot_at:
                boot_at = now + _BOOT_EVERY_S
                self._follow_boot()
            elif now >= clock_at:
                clock_at = now + _CLOCK_EVERY_S
                self._measure()

    def _measure(self) -> int | None:
        clock = self._session.clock(self._warn)
        if clock is None:
            return None
        self._queue(NewClock(clock, time.monotonic_ns()))
        return clock.boot

    def _follow_boot(self) -> None:
        # The servo started anew, perhaps with another scene. Until it answers, its events have their arrival's time.
        boot = self._measure()
        scene = self._session.scene() if boot is not None else None
        if boot is None or scene is None:
            return
        self._boot = boot
        if scene != self._scene:
            self._scene = scene
            self._queue(NewScene(scene, boot, time.monotonic_ns()))

    def _queue(self, item: Item) -> None:
        try:
            self._session.items.put_nowait(item)
        except queue.Full:
            self._session.overrun["clock"] += 1  # it is measured again

    def _warn(self, words: str) -> None:
        # A foreign program that publishes rubbish must not fill the log.
        self._log_limited.warn(words)

    # The writing thread

    def _write(self, mcap: McapWriter) -> None:
        try:
            while (item := self._next(mcap)) is not None:
                self._file(mcap, item)
            mcap.finish()
        except OSError as error:
            self.result.failure = error.strerror or str(error)
            mcap.abandon()

    def _next(self, mcap: McapWriter) -> Item | None:
        # The oldest item; None when the listening has ended and nothing is left. Ends chunks while there is none.
        while True:
            try:
                return self._session.items.get(timeout=0.0 if self._ended.is_set() else _WAKE_S)
            except queue.Empty:
                if self._ended.is_set() and self._session.items.empty():
                    return None
                mcap.chunk_if_due(time.monotonic_ns())

    def _file(self, mcap: McapWriter, item: Item) -> None:
        match item:
            case Received():
                self._file_heard(mcap, item)
            case Appeared():
                wall_ns = self._line.wall_ns(item.received_ns)
                mcap.put(channels.ALIVE, "", item.presence, wall_ns, wall_ns, time.monotonic_ns())
            case NewClock():
                if self._line.learn(item.clock):
                    facts = {
                        "boot": item.clock.boot,
                        "wall_ns": self._line.wall_ns(item.received_ns),
                        "haptic_minus_monotonic_ns": item.clock.offset_ns,
                        "clock_error_ns": item.clock.error_ns,
                    }
                    mcap.note(CLOCK_METADATA, {name: str(value) for name, value in facts.items()})
            case NewScene():
                name = f"scene-{item.boot:x}.json"
                mcap.attach_scene(name, item.payload, self._line.wall_ns(item.received_ns))

    def _file_heard(self, mcap: McapWriter, item: Received) -> None:
        try:
            message = decode(item.payload, item.channel.kind)
            log_ns, publish_ns = (
                self._line.wall_ns(item.received_ns),
                self._event_ns(message, item.received_ns),
            )
            mcap.put(item.channel, item.name, message, log_ns, publish_ns, time.monotonic_ns())
        except ValueError as error:
            self.result.unreadable += 1
            self._warn(f"{item.channel.topic} left out: {error}")
            return
        self._lost.note(item.channel, message)
        if getattr(message, "source", STICK) == STICK:
            self._heard_boot = getattr(message, "boot", self._heard_boot)

    def _event_ns(self, message: Message, received_ns: int) -> int:
        t_ns: int | None = getattr(message, "t_ns", None)
        of_no_servo = isinstance(message, Meter) or getattr(message, "source", STICK) != STICK
        boot: int | None = None if of_no_servo else getattr(message, "boot", None)
        return self._line.event_ns(t_ns, boot, received_ns)

    def _result(self, mcap: McapWriter) -> Result:
        result = self.result
        result.bytes = mcap.size
        result.messages = dict(sorted(mcap.count.items()))
        result.lost = dict(self._session.overrun)
        result.missing = {topic: n for topic, n in self._lost.missing.items() if n}
        return result


def to_stderr(words: str) -> None:
    """Print a recorder's warnings."""
    say(logging.WARNING, f"record: {words}")
