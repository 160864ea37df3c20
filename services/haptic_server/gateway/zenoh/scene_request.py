"""Asking for another scene: the gateway admits it, whoever started gateway and servo acts on it. Query thread."""

import os
from pathlib import Path

from drumstick.scenes.scene_text import shipped_names
from drumstick.scenes.table import Refusal
from haptic_server import block_header, files


class SceneRequests:
    """`is_supervised`: whether somebody looks for the file that a wish leaves in the run folder."""

    def __init__(self, run_dir: Path, is_supervised: bool) -> None:
        self._run_dir = run_dir
        self._is_supervised = is_supervised

    def ask_for(self, name: str) -> None:
        """Leave the wish for a shipped scene. Raises Refusal."""
        if not self._is_supervised:
            raise Refusal(
                "scene: this haptic server was not started by `drumstick`, which alone changes scenes"
            )
        if name not in shipped_names():
            raise Refusal(f"no scene {name[:80]!r}; shipped: {', '.join(shipped_names())}")
        if block_header.is_stuck(self._run_dir):
            # A servo put in its place would be free, and nobody would know of the fault.
            raise Refusal(
                "scene: a fault: the servo process does not tick; wait until it does, or start the rig anew"
            )
        beside = self._run_dir / f".{files.WANTED}.{os.getpid()}"
        try:
            beside.write_text(name, encoding="utf-8")
            beside.replace(self._run_dir / files.WANTED)
        except OSError as error:
            raise Refusal(f"scene: {self._run_dir} cannot be written: {error.strerror}") from None
