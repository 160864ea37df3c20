"""Progress of a change of scene that this page, or somebody else, has asked for. Pure; the main thread's."""

from web_panel.rig.rig_state import RigState

_LONGEST_S = 60.0  # longer than another scene takes to start, unless its kernels are new to this machine


class SceneChange:
    """The rig may give way to the scene before, or keep it: a refusal or the next start of the servo tells."""

    def __init__(self) -> None:
        self.asked = ""  # name of the scene that is due; "" while none is
        self._begun_at = 0.0
        self._ahead = ""  # name of the scene that was being made ready at the last look
        self._boot: int | None = None
        self._refusal = ""  # of a change before

    def begin(self, name: str, rig_state: RigState, now: float) -> None:
        """The haptic server has agreed to play this scene."""
        state = rig_state.state
        self.asked, self._begun_at = name, now
        self._boot, self._refusal = (None, "") if state is None else (state.boot, state.scene_refusal)

    def outcome(self, rig_state: RigState, now: float) -> tuple[str, bool] | None:
        """Words, and whether they alarm: of the progress, and once of the end; None while no scene is due."""
        state, is_heard = rig_state.state, rig_state.silent_s(now) == 0.0
        ahead = state.next_scene if state is not None and is_heard else ""
        is_new = ahead not in (
            "",
            self._ahead,
            self.asked,
        )  # a newer wish, by whomever, has taken this one's place
        self._ahead = ahead
        if is_new or (ahead and not self.asked):
            self.begin(ahead, rig_state, now)
        if not self.asked:
            return None
        asked, seconds = self.asked, now - self._begun_at
        if rig_state.scene is not None and rig_state.scene_boot not in (None, self._boot):
            self.asked = ""
            playing = rig_state.scene.name
            if playing == asked:
                return f"{playing} is playing", False
            return f"{asked} could not be played; back to {playing}", True
        if state is not None and state.scene_refusal not in ("", self._refusal):
            self.asked = ""
            return state.scene_refusal, True
        if seconds < _LONGEST_S or ahead == asked:
            return f"{asked} is starting: {seconds:.0f} s", False
        self.asked = ""
        return f"{asked} has not started within {_LONGEST_S:.0f} s", True
