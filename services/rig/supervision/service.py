"""`drumstick service`: become one process of a rig, for systemd to supervise instead of `drumstick up`."""

import logging
import os
import sys
from typing import NoReturn

from realtime.log import say
from rig import checks, folder
from rig.exit_status import unavailable, usage_error
from rig.network import osc_targets
from rig.supervision.plan import Options, commands
from rig.supervision.router_check import require_admission

SERVICES = ("servo", "gateway", "door", "sound", "panel")


def _say(words: str) -> None:
    say(logging.INFO, f"drumstick: {words}")


def exec_service(name: str, options: Options) -> NoReturn:
    """Replace this process by the service, with the command line that `drumstick up` would give it. Raises
    CommandError."""
    command = commands(options).get(name)
    if command is None:
        usage_error(
            f"service {name}: the rig file opens no public listener (zenoh.public): nothing to do here"
        )
    require_admission(options)
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(command[0], command)


def become_gateway(options: Options) -> NoReturn:
    """The gateway of a scene that lies in the run folder. Raises CommandError."""
    from haptic_server import files

    if not (options.folder / files.SCENE).is_file():
        unavailable(
            f"{options.folder} holds no scene: the servo of rig {options.rig!r} lays it out; start that first"
        )
    with osc_targets.publish_and_warn(options.folder, options.osc_sender) as published:
        os.set_inheritable(published.fileno(), True)  # open as long as the gateway lives
        exec_service("gateway", options)


def become_servo(options: Options, scene: str) -> NoReturn:
    """The servo, for the scene that is due; it holds the rig's lock as long as it lives. Raises CommandError."""
    from rig.supervision.scenes import scene_change

    lock = folder.claim(options.folder, options.rig)
    scene_change.install_scene(options.folder, scene, _say, options.rig)
    os.set_inheritable(lock.fileno(), True)
    exec_service("servo", options)


def reload_servo(options: Options, main_pid: str) -> None:
    """Have a servo of the scene that somebody asked for follow the one of process `main_pid`. Raises CommandError."""
    from rig.supervision.scenes import servo_reload

    if not main_pid.isdecimal():
        usage_error(f"servo-reload: {main_pid!r} is no process id: systemd names it in MAINPID")
    servo_reload.reload_servo(options, int(main_pid), _say)


def servo_ticks(rig: str) -> None:
    """Note that the scene plays, after the servo said that it is ready."""
    from rig.supervision.scenes import scene_change

    checks.rig_name(rig)
    scene_change.played(folder.run_folder(rig))


def servo_ended(rig: str, how: str, status: str) -> None:
    """Note how the servo ended; `how` and `status` as systemd tells them (EXIT_CODE, EXIT_STATUS). Raises
    CommandError."""
    from rig.supervision.scenes import scene_change

    checks.rig_name(rig)
    if how == "exited" and status.isdecimal():
        run = folder.run_folder(rig)
        with folder.claim(run, rig):
            scene_change.ended(run, int(status), _say)
