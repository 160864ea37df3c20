"""The scene that is made ready while another plays: its compiled functions are loaded here, its name is told.

`look` belongs to the relay thread and does not wait; a thread of its own loads.
"""

import logging
import threading
from collections.abc import Callable
from pathlib import Path

from drumstick.scenes.scene_text import SceneError, as_tables, parse
from drumstick.stick.law import law_of
from haptic_server import files
from haptic_server.gateway.link import warm_up
from haptic_server.gateway.scenes.playing import scene_text

_log = logging.getLogger("gateway")
_LOOK_EVERY_S = 0.02


class SceneAhead:
    """Scene in the folder `next` of a run folder, made there by whoever started us; `playing`: text of ours.

    `take_refusal` gives, once, why a scene that was asked for does not play. Called on the relay thread.
    """

    def __init__(self, run_dir: Path, playing: str, take_refusal: Callable[[], str] = str) -> None:
        self._take_refusal = take_refusal
        self._run_dir, self._folder, self._playing = run_dir, run_dir / files.NEXT, playing
        self._scene_file = self._folder / files.SCENE
        self._seen = 0
        self.name = ""
        self.tables: dict[str, object] | None = None
        self.refusal = ""

    def look(self) -> str:
        """Take notice of a scene that is made ready, or no longer. Why one was refused, once; "" otherwise."""
        seen = self._inode()
        if seen != self._seen:
            self._seen, self.name, self.tables = seen, "", None
            if seen:
                self.refusal = ""
                threading.Thread(target=self._load, args=(seen,), name="next scene", daemon=True).start()
        words = self._take_refusal()
        self.refusal = words or self.refusal
        return words

    def has_come(self) -> bool:
        """True when the scene in the run folder is another than ours; to be asked when there is a new servo."""
        try:
            return scene_text(self._run_dir) != self._playing
        except (OSError, UnicodeDecodeError):
            return False  # the servo that is there plays on

    def _inode(self) -> int:
        try:
            return self._scene_file.stat().st_ino
        except OSError:
            return 0

    def _load(self, seen: int) -> None:
        try:
            scene = parse(scene_text(self._folder), files.SCENE)
        except (OSError, UnicodeDecodeError, SceneError):
            return  # its servo says why
        if self._seen != seen:
            return  # another one already
        self.tables, self.name = as_tables(scene), scene.name
        pause = threading.Event()
        while not (self._folder / files.SERVO_READY).exists():  # which has compiled for us too
            if self._inode() != seen:
                return
            pause.wait(_LOOK_EVERY_S)
        warm_up(law_of(scene))
        if self._inode() != seen:
            return
        try:
            (self._folder / files.GATEWAY_READY).touch()
        except OSError as error:
            _log.warning("the next scene: %s", error.strerror)
