"""What became of the scene that was asked for. Pure; the main thread's."""

from web_panel.rig.mirror import Mirror


class SceneChange:
    """The rig may give way to the scene before, or keep it: only the next start of the servo tells."""

    def __init__(self) -> None:
        self._asked = ""
        self._boot: int | None = None

    def begin(self, name: str, mirror: Mirror) -> None:
        """The haptic server has agreed to play this scene."""
        self._asked, self._boot = name, mirror.state.boot if mirror.state is not None else None

    def outcome(self, mirror: Mirror) -> tuple[str, bool] | None:
        """Words, and whether they alarm, once there is another start of the servo that has told its scene."""
        if not self._asked or mirror.scene is None or mirror.scene_boot in (None, self._boot):
            return None
        asked, self._asked = self._asked, ""
        playing = mirror.scene.name
        if playing == asked:
            return f"{playing} is playing", False
        return f"{asked} could not be played; back to {playing}", True
