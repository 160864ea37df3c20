"""Trim of a sound server's output to the room it plays in: how much later and louder than the scene says, and where."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

from sound_server.outputs import Outputs

if TYPE_CHECKING:  # the options of this service are read without a compiler
    from drumstick.parameters.scene import Scene


class OutputTrim(NamedTuple):
    """delay_s: 0..0.5, beyond the scene's latency; gain_dB: -60..12, beyond the scene's own; outputs: pairs of rigs."""

    delay_s: float = 0.0
    gain_dB: float = 0.0
    outputs: Outputs = ()

    @property
    def gain(self) -> float:
        """The gain as a factor."""
        return 10.0 ** (self.gain_dB / 20.0)

    @property
    def description(self) -> str:
        """Description for the log and the meter; empty for a trim that changes nothing."""
        later = f"{1e3 * self.delay_s:g} ms later" if self.delay_s else ""
        louder = f"{self.gain_dB:+g} dB" if self.gain_dB else ""
        return ", ".join(filter(None, (later, louder)))

    def later(self, scene: Scene) -> Scene:
        """The scene with the delay in its own latency, for what must have room in memory for both."""
        if not self.delay_s:
            return scene
        drum = dataclasses.replace(scene.drum, latency_s=scene.drum.latency_s + self.delay_s)
        return dataclasses.replace(scene, drum=drum)
