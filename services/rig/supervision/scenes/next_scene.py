"""The scene that is made ready in the folder `next` of a run folder, beside the one that plays. One thread."""

import shutil
from pathlib import Path

from haptic_server import files
from rig import folder
from rig.scene_file import SceneFiles


class NextScene:
    """Its files, laid out for a servo that waits for its turn, and the marks of who is ready for it.

    Made for the holder of the rig's lock. Raises CommandError, OSError.
    """

    def __init__(self, run: Path, scene: SceneFiles) -> None:
        self.scene = scene
        self._run = run
        self.clear()
        (run / files.NEXT).mkdir(mode=0o700)
        scene.lay_out(run / files.NEXT)

    def is_ready(self) -> bool:
        """True when servo and gateway have compiled and loaded all that this scene needs."""
        here = self._run / files.NEXT
        return (here / files.SERVO_READY).exists() and (here / files.GATEWAY_READY).exists()

    def put(self, pid: int) -> None:
        """Into the place of the one that played, whose servo has ended; the servo with this process id may take the
        arm. Raises CommandError."""
        self.scene.put(self._run)
        folder.put_text(self._run / files.TURN, str(pid))
        self.clear()

    def clear(self) -> None:
        """Remove what was laid out: a gateway announces it as long as it lies there."""
        shutil.rmtree(self._run / files.NEXT, ignore_errors=True)
