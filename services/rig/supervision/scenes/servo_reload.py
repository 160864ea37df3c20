"""Another scene under systemd: `systemctl reload` of the force loop's unit makes a servo ready beside the present one.

The way of `drumstick up`: the gateway plays on, and the arm has one owner at every instant. systemd runs this beside
the unit's main process, as its user and in its sandbox; the new servo then becomes the main process. One thread.
"""

import os
import select
import signal
import subprocess
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import IO, Self

from haptic_server import block_header, files
from realtime.notify import Supervisor, name_main_process
from rig import folder
from rig.exit_status import OURS, CommandError
from rig.scene_file import Say
from rig.supervision.plan import Options, next_servo
from rig.supervision.scenes import requested_scene, scene_change
from rig.supervision.scenes.next_scene import NextScene

_POLL_S = 0.02
_STOP_WITHIN_S = 4.0
_WATCHDOG = "WATCHDOG_USEC="  # systemd gives it to the main process alone


class _PlayingServo:
    """The unit's main process, by a handle that never means another one.

    environment: ours, with what systemd gives to the main process alone.
    """

    def __init__(self, pid: int) -> None:
        try:
            self._handle = os.pidfd_open(pid)
        except ProcessLookupError:
            raise CommandError(OURS, "the force loop has ended") from None
        given = Path(f"/proc/{pid}/environ").read_bytes().decode("utf-8", "replace").split("\0")
        watchdog = dict(each.split("=", 1) for each in given if each.startswith(_WATCHDOG))
        self.environment = {**os.environ, **watchdog}

    def has_ended(self, within_s: float) -> bool:
        """Wait so long for its end."""
        return bool(select.select([self._handle], [], [], within_s)[0])

    def stop(self) -> None:
        """End it. Returns when it has ended."""
        for number in (signal.SIGTERM, signal.SIGKILL):
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._handle, number)
            if self.has_ended(_STOP_WITHIN_S):
                return
        raise CommandError(OURS, "the force loop cannot be ended")

    def __enter__(self) -> Self:
        """Nothing to do: it is open."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give the handle back."""
        os.close(self._handle)


def reload_servo(options: Options, main_pid: int, say: Say) -> None:
    """Play the scene that somebody asked for; where it cannot be made ready, refuse it and let the present one play on.

    main_pid: the unit's main process. Raises CommandError where that has ended and nothing ticks in its place.
    """
    run = options.folder

    def refuse(words: str) -> None:
        say(words)
        with suppress(CommandError):  # a place that is full must not end what plays
            folder.put_text(run / files.REFUSED, words)

    wanted = requested_scene.take(run, say, refuse)
    if wanted is None:
        return
    if block_header.was_held(run):
        refuse(scene_change.held_words(options.rig))
        return
    say(f"another scene: {wanted.name}")
    with _PlayingServo(main_pid) as playing, ExitStack() as unless_it_ticks:
        try:
            ahead = NextScene(run, wanted)
            unless_it_ticks.callback(ahead.clear)
            lock = unless_it_ticks.enter_context(folder.open_lock(run))
            servo = _start(options, lock, playing)
            unless_it_ticks.callback(_end, servo)
        except (OSError, CommandError) as error:
            refuse(f"the scene {wanted.name} cannot be made ready: {error}")
            return
        if not _gets_ready(servo, ahead, playing, run):
            if servo.poll() is not None:
                refuse(f"the scene {wanted.name} cannot be played here: the one before plays on")
            return
        if block_header.was_held(run):
            refuse(scene_change.held_words(options.rig))
            return
        try:
            name_main_process(servo.pid)  # before the old one ends: its end would be the unit's
        except OSError as error:
            refuse(f"the scene {wanted.name} cannot be played: systemd: {error}")
            return
        playing.stop()
        folder.take(lock, options.rig)
        scene_change.keep_way_back(run)
        ahead.put(servo.pid)
        _wait_until_it_ticks(servo, run, playing)
        scene_change.played(run)
        unless_it_ticks.pop_all()  # its files are in their place, and systemd has the process


def _start(options: Options, lock: IO[str], playing: _PlayingServo) -> subprocess.Popen[bytes]:
    # It inherits the lock before anybody of us holds it: once taken here, it is the servo's for as long as that lives.
    return subprocess.Popen(
        next_servo(options),
        stdin=subprocess.DEVNULL,
        pass_fds=[lock.fileno()],
        env=playing.environment,
    )


def _end(servo: subprocess.Popen[bytes]) -> None:
    servo.kill()
    servo.wait()


def _gets_ready(servo: subprocess.Popen[bytes], ahead: NextScene, playing: _PlayingServo, run: Path) -> bool:
    # False too when somebody asks for yet another scene: systemd sees that, and reloads for it.
    while not ahead.is_ready():
        if playing.has_ended(_POLL_S):
            raise CommandError(OURS, "the force loop ended while another scene was made ready")
        if servo.poll() is not None or (run / files.WANTED).exists():
            return False
    return True


def _wait_until_it_ticks(servo: subprocess.Popen[bytes], run: Path, playing: _PlayingServo) -> None:
    supervisor = Supervisor(playing.environment)  # to open an arm takes longer than the watchdog waits
    while True:
        found = block_header.read_header(run)
        if found is not None and found.pid == servo.pid and block_header.is_alive(found.control):
            return
        if servo.poll() is not None:
            raise CommandError(OURS, f"the force loop of another scene ended with status {servo.returncode}")
        supervisor.notify_alive("another scene takes over")
        time.sleep(_POLL_S)
