"""The room that a sound server plays in: how much later and louder than the scene says its drums sound."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:  # the options of this service are read without a compiler
    from drumstick.parameters.scene import Scene


class Room(NamedTuple):
    """latency_s: 0..0.5, beyond the scene's; level_dB: -60..12, beyond the scene's."""

    latency_s: float = 0.0
    level_dB: float = 0.0

    @property
    def gain(self) -> float:
        """The level as a factor."""
        return 10.0 ** (self.level_dB / 20.0)

    @property
    def words(self) -> str:
        """Description for the log and the meter; empty for a room that changes nothing."""
        later = f"{1e3 * self.latency_s:g} ms later" if self.latency_s else ""
        louder = f"{self.level_dB:+g} dB" if self.level_dB else ""
        return ", ".join(filter(None, (later, louder)))

    def later(self, scene: Scene) -> Scene:
        """The scene with the room's latency in its own, for what must have room in memory for both."""
        if not self.latency_s:
            return scene
        drum = dataclasses.replace(scene.drum, latency_s=scene.drum.latency_s + self.latency_s)
        return dataclasses.replace(scene, drum=drum)
