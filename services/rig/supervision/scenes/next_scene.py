"""The scene that is made ready in the folder `next` of a run folder, beside the one that plays. One thread."""

import os
import shutil
from contextlib import suppress
from pathlib import Path

from haptic_server import block_header, files
from rig.exit_status import CommandError
from rig.scene_file import SceneFiles


class NextScene:
    """Its files, laid out for a servo that waits for its turn, and the pipe by which that gets it.

    turn: the pipe's end for the servo to inherit (ServoOptions.turn). For the holder of the rig's lock,
    or beside it. Raises CommandError, OSError.
    """

    def __init__(self, run: Path, scene: SceneFiles) -> None:
        self.scene = scene
        self._run = run
        shutil.rmtree(run / files.NEXT, ignore_errors=True)
        self.turn, self._gives = os.pipe()
        try:
            (run / files.NEXT).mkdir(mode=0o700)
            scene.lay_out(run / files.NEXT)
        except BaseException:
            self.clear()
            raise

    def is_ready(self) -> bool:
        """True when servo and gateway have compiled and loaded all that this scene needs."""
        here = self._run / files.NEXT
        return (here / files.SERVO_READY).exists() and (here / files.GATEWAY_READY).exists()

    def put(self) -> None:
        """Into the place of the one that played, whose servo has ended; the servo that waits may take the arm. Raises
        OSError."""
        block_header.invalidate(self._run)
        for name in (files.GESTURE, files.SCENE):  # moved: a place that is full must not be met only now
            with suppress(FileNotFoundError):  # no gesture
                (self._run / files.NEXT / name).replace(self._run / name)
        with suppress(CommandError):  # a list that stands still is no reason to stand still
            self.scene.reach(self._run)
        os.write(self._gives, b"\n")

    def clear(self) -> None:
        """Remove what was laid out: a gateway announces it as long as it lies there. A servo that has had no turn gets
        none any more."""
        shutil.rmtree(self._run / files.NEXT, ignore_errors=True)
        for end in (self.turn, self._gives):
            with suppress(OSError):
                os.close(end)
        self.turn = self._gives = -1
