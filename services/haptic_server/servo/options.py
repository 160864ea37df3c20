"""Options of the servo's process. Any thread."""

from pathlib import Path

from realtime.service_options import ServiceOptions


class ServoOptions(ServiceOptions, frozen=True, kw_only=True):
    """run_dir holds scene.toml, and the block is made there; device: as `drumstick up --device`.

    turn_by: the scene lies in the folder `next` of run_dir; all is made ready, and the arm left alone until the file
    `turn` names this process. It is our parent, who gives the turn: with its end none comes. 0: at once.
    pose_is_held: somebody holds a real arm in its neutral pose now, so that its encoders may be reset.
    """

    run_dir: Path
    device: str = "simulated"
    pose_is_held: bool = False
    turn_by: int = 0
