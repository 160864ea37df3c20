"""Options of the recorder's process. Any thread."""

from pathlib import Path

from protocol.access.identity import Identity
from protocol.keys import checked_rig
from realtime.service_options import ServiceOptions


class RecordingOptions(ServiceOptions, frozen=True, kw_only=True):
    """out: FILE.mcap, or FILE-2.mcap if that exists; force: also the force of every contact."""

    rig: str
    connect: str
    out: Path
    identity: Identity | None = None
    force: bool = False

    def __post_init__(self) -> None:
        checked_rig(self.rig)
