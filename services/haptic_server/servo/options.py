"""Options of the servo's process. Any thread."""

from pathlib import Path

from realtime.service_options import ServiceOptions


class ServoOptions(ServiceOptions, frozen=True, kw_only=True):
    """run_dir holds scene.toml, and the block is made there; device: as `drumstick up --device`.

    turn: a pipe's descriptor. The scene lies in the folder `next` of run_dir; all is made ready, and the arm left alone
    until a byte comes; the pipe ends with the process that would send it. -1: at once.
    pose_is_held: somebody holds a real arm in its neutral pose now, so that its encoders may be reset.
    """

    run_dir: Path
    device: str = "simulated"
    pose_is_held: bool = False
    turn: int = -1

    @property
    def waits_for_turn(self) -> bool:
        """True when another servo plays until then."""
        return self.turn >= 0
