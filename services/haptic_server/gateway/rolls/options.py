"""Options of the process that finds rolls. Any thread."""

from pathlib import Path

from realtime.service_options import ServiceOptions


class FinderOptions(ServiceOptions, frozen=True, kw_only=True):
    """run_dir holds scene.toml and what the device allows."""

    run_dir: Path
