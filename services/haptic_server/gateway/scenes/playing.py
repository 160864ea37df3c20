"""The scene that plays, and all that a gateway has for it alone: another scene is another one of these."""

from __future__ import annotations

import json
from pathlib import Path

from drumstick.scenes.scene_text import as_tables, parse
from drumstick.scenes.table import values_of
from drumstick.stick.law import law_of
from haptic_server import files, limits
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.options import GatewayOptions
from haptic_server.gateway.played_strikes import PlayedStrikes
from haptic_server.gateway.presets import Presets
from haptic_server.gateway.rolls.messages import Answer
from haptic_server.gateway.rolls.rolls import Rolls
from haptic_server.gateway.scenes.requests import SceneRequests
from haptic_server.gateway.settings import Parameters
from haptic_server.presets.store import PresetStore
from realtime.regular_file import read_text
from realtime.service_options import command
from realtime.worker_process import WorkerProcess

_FINDER_RESTS_S = 10.0  # after it ended by itself: each start costs a second of a processor


def scene_text(run_dir: Path) -> str:
    """Text of the scene that lies in this folder. Raises OSError, UnicodeDecodeError."""
    return read_text(run_dir / files.SCENE, files.MAX_SCENE_BYTES)


class Playing:
    """Parts of a gateway that belong to the scene of `text` and to the servo of `link`."""

    def __init__(self, given: GatewayOptions, text: str, link: ServoLink) -> None:
        self.text, self.link = text, link
        self.scene = parse(text, files.SCENE)
        self.json = json.dumps(as_tables(self.scene))
        self.parameters = Parameters(self.scene, link, limits.read(given.run_dir, self.scene), rig=given.rig)
        values = values_of(law_of(self.scene), self.parameters.table)
        self.presets = Presets(PresetStore(given.state_dir), self.parameters, self.scene.name, values)
        self.played = PlayedStrikes(self.scene.strike, self.parameters)
        self.requests = SceneRequests(given.run_dir, given.supervised, self.parameters.require_quiet)
        finder = WorkerProcess[Answer](command("haptic_server.gateway.rolls", given), Answer, _FINDER_RESTS_S)
        self.rolls = Rolls(self.parameters, finder, self.scene)
        self.rolls.start()
