"""The scene that a rig plays, as it lies in the run folder for servo and gateway."""

from dataclasses import dataclass
from pathlib import Path

from rig import folder


@dataclass(frozen=True)
class SceneFiles:
    """A scene's name, its text, and that of its recorded gesture if it has one."""

    name: str
    text: str = ""
    gesture: str | None = None

    def put(self, run: Path) -> None:
        """Into the run folder, whose servo must not run; what it had made of another scene goes. Raises
        CommandError."""
        from haptic_server import block_header, files

        block_header.invalidate(run)  # whoever made it is dead: we hold the lock
        folder.put_text(run / files.SCENE, self.text)
        if self.gesture is not None:
            folder.put_text(run / files.GESTURE, self.gesture)
