"""Finding a scene by shipped name or file, read and validated, with one clear message otherwise.

`SceneFiles` is what a rig plays of it, as servo and gateway find it in their run folder.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from realtime.log import say as say_on_stderr
from realtime.regular_file import read_text
from rig import folder
from rig.exit_status import usage_error

if TYPE_CHECKING:
    from drumstick.files import SceneText
    from drumstick.parameters.scene import Scene

Say = Callable[[str], None]


def to_stderr(words: str) -> None:
    """Print what a scene's reader notes."""
    say_on_stderr(logging.WARNING, f"drumstick: {words}")


@dataclass(frozen=True)
class SceneFiles:
    """A scene's name, its text, and that of its recorded gesture if it has one.

    place: in the set list, from 0, that is reached when it is put; None: it moves none.
    """

    name: str
    text: str = ""
    gesture: str | None = None
    place: int | None = None

    def put(self, run: Path) -> None:
        """Into the run folder, whose servo must not run; what it had made of another scene goes. The set list moves
        here, and no sooner: a change that was refused must leave it where it was. Raises CommandError."""
        from haptic_server import block_header

        block_header.invalidate(run)  # whoever made it is dead: we hold the lock
        self.lay_out(run)
        self.reach(run)

    def reach(self, run: Path) -> None:
        """Move the set list here. Raises CommandError."""
        from haptic_server import files, set_list

        listed = set_list.read(run)
        if listed is not None and self.place is not None:
            folder.put_text(run / files.SET_LIST, msgspec.structs.replace(listed, at=self.place).text())

    def lay_out(self, run: Path) -> None:
        """Write the files only. Raises CommandError."""
        from haptic_server import files

        folder.put_text(run / files.SCENE, self.text)
        if self.gesture is not None:
            folder.put_text(run / files.GESTURE, self.gesture)


def read(scene: str) -> SceneText:
    """The text of a shipped scene or of a file (anything with a / or ending in .toml). Raises CommandError."""
    from drumstick.files import scene_text
    from drumstick.scenes.scene_text import SceneError

    try:
        return scene_text(scene)
    except SceneError as error:
        usage_error(str(error))


def _gesture_text(scene: str, file_name: str) -> str:
    # Beside the scene: in the package for a shipped one, else in the scene file's own folder.
    from drumstick.scenes.recording import MAX_BYTES
    from drumstick.scenes.scene_text import shipped_gesture, shipped_names

    if scene in shipped_names():
        return shipped_gesture(file_name)
    return read_text(Path(scene).parent / file_name, MAX_BYTES)


def _require_spread(loaded: Scene) -> None:
    # The only scenes whose reading compiles the stick: none other waits for that.
    from drumstick.scenes.gesture import played_gesture
    from drumstick.scenes.scene_text import SceneError

    try:
        played_gesture(loaded, None)
    except SceneError as error:
        usage_error(str(error))


def gesture(scene: str, loaded: Scene) -> str | None:
    """The text of the scene's recorded gesture, checked; None when it has none. Raises CommandError.

    Also where the scene's hand cannot be as uneven as it asks for.
    """
    if loaded.hand.human is not None:
        _require_spread(loaded)
    from drumstick.scenes.recording import TrajectoryError
    from haptic_server.servo.device.gesture import gesture_of

    name = loaded.hand.gesture_file
    if not name:
        return None
    try:
        text = _gesture_text(scene, name)
        gesture_of(StringIO(text, newline=""), name, loaded)
    except TrajectoryError as error:
        usage_error(f"{scene}: hand.gesture_file: {error}")
    except UnicodeDecodeError:
        usage_error(f"{scene}: hand.gesture_file: {name}: not UTF-8 text; give CSV")
    except OSError as error:
        usage_error(
            f"{scene}: hand.gesture_file: {name}: cannot be read: {error.strerror}; it must lie beside the scene"
        )
    return text


def scene_files(scene: str, say: Say) -> SceneFiles:
    """The scene and its gesture, both checked, ready for a run folder; `say` is for notes. Raises CommandError.

    Also for a scene that is played offline only.
    """
    loaded = load(scene, say)
    if loaded.hand.why_not_live:
        usage_error(f"{loaded.name} {loaded.hand.why_not_live}")
    return SceneFiles(loaded.name, read(scene).text, gesture(scene, loaded))


def load(scene: str, say: Say = to_stderr):
    """The validated scene; `say` gets what should be written otherwise. Raises CommandError with every mistake."""
    from drumstick.scenes.scene_text import SceneError, parse

    found = read(scene)
    notes: list[str] = []
    try:
        loaded = parse(found.text, found.source, notes)
    except SceneError as error:
        usage_error(str(error))
    for note in notes:
        say(note)
    return loaded
