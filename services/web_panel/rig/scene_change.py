"""Progress of a requested change of scene. Pure; the main thread's."""

from web_panel.rig.rig_state import RigState

_LONGEST_S = 60.0  # longer than another scene takes to start, unless its kernels are new to this machine


class SceneChange:
    """The rig may give way to the scene before, or keep it: only the next start of the servo tells."""

    def __init__(self) -> None:
        self.asked = ""  # name of the scene that is due; "" while none is
        self._begun_at = 0.0
        self._boot: int | None = None

    def begin(self, name: str, rig_state: RigState, now: float) -> None:
        """The haptic server has agreed to play this scene."""
        self.asked, self._begun_at = name, now
        self._boot = rig_state.state.boot if rig_state.state is not None else None

    def outcome(self, rig_state: RigState, now: float) -> tuple[str, bool] | None:
        """Words, and whether they alarm: of the progress, and once of the end; None while no scene is due."""
        if not self.asked:
            return None
        asked, seconds = self.asked, now - self._begun_at
        if rig_state.scene is None or rig_state.scene_boot in (None, self._boot):
            if seconds < _LONGEST_S or (rig_state.state is not None and rig_state.state.next_scene == asked):
                return f"{asked} is starting: {seconds:.0f} s", False
            self.asked = ""
            return f"{asked} has not started within {_LONGEST_S:.0f} s", True
        self.asked = ""
        playing = rig_state.scene.name
        if playing == asked:
            return f"{playing} is playing", False
        return f"{asked} could not be played; back to {playing}", True
