"""Options of the recorder's process. Any thread."""

from pathlib import Path

from protocol.access.identity import Identity
from realtime.service_options import ServiceOptions


class RecordingOptions(ServiceOptions, frozen=True):
    """out: FILE.mcap, or FILE-2.mcap if that exists; force: also the force of every contact."""

    rig: str
    connect: str
    out: Path
    identity: Identity | None = None
    force: bool = False
