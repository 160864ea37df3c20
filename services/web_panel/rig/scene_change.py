"""Progress of a requested change of scene. Pure; the main thread's."""

from web_panel.rig.rig_state import RigState


class SceneChange:
    """The rig may give way to the scene before, or keep it: only the next start of the servo tells."""

    def __init__(self) -> None:
        self._asked = ""
        self._boot: int | None = None

    def begin(self, name: str, rig_state: RigState) -> None:
        """The haptic server has agreed to play this scene."""
        self._asked, self._boot = name, rig_state.state.boot if rig_state.state is not None else None

    def outcome(self, rig_state: RigState) -> tuple[str, bool] | None:
        """Words, and whether they alarm, once there is another start of the servo that has told its scene."""
        if not self._asked or rig_state.scene is None or rig_state.scene_boot in (None, self._boot):
            return None
        asked, self._asked = self._asked, ""
        playing = rig_state.scene.name
        if playing == asked:
            return f"{playing} is playing", False
        return f"{asked} could not be played; back to {playing}", True
