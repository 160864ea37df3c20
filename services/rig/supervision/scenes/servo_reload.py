"""Another scene under systemd: `systemctl reload` of the force loop's unit makes a servo ready beside the present one.

The way of `drumstick up`: the gateway plays on, and the arm has one owner at every instant. systemd runs this beside
the unit's main process, as its user and in its sandbox; the new servo then becomes the main process. One thread.
"""

import os
import select
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import IO, Self

from haptic_server import block_header, files
from realtime.notify import Supervisor, name_main_process
from realtime.stop import on_stop_signals
from rig import folder
from rig.exit_status import OURS, CommandError
from rig.scene_file import Say, SceneFiles
from rig.supervision.plan import Options, next_servo
from rig.supervision.scenes import requested_scene, scene_change
from rig.supervision.scenes.next_scene import NextScene

_POLL_S = 0.02
_STOP_WITHIN_S = 4.0
_END_WITHIN_S = 2.0  # twice that is less than the unit's TimeoutStopSec
_READY_WITHIN_S = 600.0  # as `drumstick up`
_WATCHDOG = "WATCHDOG_USEC="  # systemd gives it to the main process alone


class _Process:
    """Some process, by a handle that never means a later one of the same number. Raises ProcessLookupError."""

    def __init__(self, pid: int) -> None:
        self.pid, self._handle = pid, os.pidfd_open(pid)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._handle)

    def has_ended(self, within_s: float = 0.0) -> bool:
        """Wait so long for its end."""
        return bool(select.select([self._handle], [], [], within_s)[0])

    def send(self, number: signal.Signals) -> None:
        """Send a signal, where it is still there."""
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, number)

    def end(self) -> None:
        """End it in good order, so that an arm is switched off; by force where that takes too long."""
        for number in (signal.SIGTERM, signal.SIGKILL):
            self.send(number)
            if self.has_ended(_END_WITHIN_S):
                return


def reload_servo(options: Options, main_pid: int, say: Say) -> None:
    """Play the scene that somebody asked for; where it cannot be made ready, refuse it and let the present one play on.

    main_pid: the unit's main process. Raises CommandError where that has ended: systemd starts the unit anew.
    """
    on_stop_signals(lambda *_: sys.exit(OURS))  # and what was begun is cleared away

    def refuse(words: str) -> None:
        say(words)
        with suppress(CommandError):  # a place that is full must not end what plays
            folder.put_text(options.folder / files.REFUSED, words)

    wanted = requested_scene.take(options.folder, say, refuse)
    if wanted is None:
        return
    try:
        with _Process(main_pid) as playing:
            try:
                _change(options, wanted, playing, say)
            except (OSError, CommandError) as error:
                why = getattr(error, "strerror", None) or error
                refuse(f"the scene {wanted.name} is not played: {why}")
                if playing.has_ended():
                    raise CommandError(OURS, "the force loop starts anew") from error
    except ProcessLookupError:
        refuse(f"the scene {wanted.name} is not played: the force loop has ended; ask again when it is back")
        raise CommandError(OURS, "the force loop starts anew") from None


def _change(options: Options, wanted: SceneFiles, playing: _Process, say: Say) -> None:
    # CommandError and OSError say why not. Until the force loop that plays is stopped, it plays on.
    run = options.folder
    _require_free(options)
    say(f"another scene: {wanted.name}")
    with ExitStack() as unless_it_ticks:
        ahead = NextScene(run, wanted)
        unless_it_ticks.callback(ahead.clear)
        lock = unless_it_ticks.enter_context(folder.open_lock(run))
        environment = _environment(playing.pid)
        servo = unless_it_ticks.enter_context(_started(options, ahead.turn, lock, environment))
        unless_it_ticks.callback(servo.end)
        until_s = time.monotonic() + _READY_WITHIN_S
        while not ahead.is_ready():
            if servo.has_ended(_POLL_S):
                raise CommandError(OURS, "it cannot be played here; the present one plays on")
            if time.monotonic() > until_s:
                raise CommandError(
                    OURS, f"it was not ready after {_READY_WITHIN_S:.0f} s; the present one plays on"
                )
            if playing.has_ended():
                raise CommandError(OURS, "the force loop ended meanwhile; ask again when it is back")
            if (run / files.WANTED).exists():  # yet another one: systemd sees that, and reloads for it
                return
        _require_free(options)
        supervisor = Supervisor(environment)  # systemd hears the old servo no more, and the new one not yet
        scene_change.keep_way_back(run)
        try:
            name_main_process(servo.pid)  # before the old one ends: its end would be the unit's
        except OSError:
            scene_change.played(run)
            name_main_process(playing.pid, waits=False)  # where the first name is taken up late
            raise
        except SystemExit:  # the unit is stopped, and systemd may know of the new one only
            playing.end()
            raise
        unless_it_ticks.callback(playing.end)
        _stop(playing, supervisor)
        folder.take(lock, options.rig)
        ahead.put()
        while not _ticks(run, servo):
            if servo.has_ended(_POLL_S):
                raise CommandError(OURS, "its force loop ended; the one before is tried")
            supervisor.notify_alive("another scene takes over")
        scene_change.played(run)
        unless_it_ticks.pop_all()
        ahead.clear()


def _require_free(options: Options) -> None:
    if block_header.was_held(options.folder):
        raise CommandError(OURS, scene_change.held_words(options.rig, as_unit=True))


def _environment(main_pid: int) -> dict[str, str]:
    # Ours, with what systemd gives to the main process alone.
    given = Path(f"/proc/{main_pid}/environ").read_bytes().decode("utf-8", "replace").split("\0")
    return {**os.environ, **dict(each.split("=", 1) for each in given if each.startswith(_WATCHDOG))}


def _started(options: Options, turn: int, lock: IO[str], environment: dict[str, str]) -> _Process:
    # By a shell that ends at once, so that its parent is systemd: only of a child does systemd wait for the end and see
    # the status. It inherits the lock before anybody of us holds it: taken later, it is the servo's while that lives.
    inherited = (turn, lock.fileno())
    shell = ["/bin/sh", "-c", '"$@" >&2 & echo $!', "sh", *next_servo(options, turn)]
    said = subprocess.run(
        shell,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        check=False,
        pass_fds=inherited,
        env=environment,
    ).stdout.strip()
    if not said.isdigit():
        raise CommandError(OURS, "no process can be started for it; the present one plays on")
    try:
        return _Process(int(said))
    except ProcessLookupError:
        raise CommandError(OURS, "its force loop ended at once; the present one plays on") from None


def _stop(playing: _Process, supervisor: Supervisor) -> None:
    for number in (signal.SIGTERM, signal.SIGKILL):
        playing.send(number)
        until_s = time.monotonic() + _STOP_WITHIN_S
        while time.monotonic() < until_s:
            if playing.has_ended(_POLL_S):
                return
            supervisor.notify_alive("another scene takes over")
    raise CommandError(OURS, "the force loop that plays cannot be ended")


def _ticks(run: Path, servo: _Process) -> bool:
    found = block_header.read_header(run)
    return found is not None and found.pid == servo.pid and block_header.is_alive(found.control)
