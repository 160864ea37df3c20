"""A drum that streams, played in virtual time: what force reaches the mesh in each of its steps."""

import dataclasses

import numpy as np

from drumstick.drum.build import new_engine
from drumstick.drum.excitation.feed import Feed
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.memory.timeline import StreamState
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import shipped_text
from drumstick_lab.accuracy.drums.blows import pressed

MS = 1_000_000
STREAMS = 'excitation = "streamed"'
_STEPS = 8  # of the mesh in a block: half a millisecond


def streamed(latency_s: float = 0.0) -> Scene:
    """The default drum, excited by streamed forces."""
    scene = Scene("drum")
    return dataclasses.replace(
        scene, drum=dataclasses.replace(scene.drum, excitation="streamed", latency_s=latency_s)
    )


def streamed_text(name: str = "roll") -> str:
    """A shipped scene, as TOML, made to stream if it does not."""
    text = shipped_text(name)
    return text if STREAMS in text else text.replace("[drum]", f"[drum]\n{STREAMS}")


class Player:
    """Its clock is `now_ns`; all `sounds` so far."""

    def __init__(self, now_ns: int = 1000 * MS) -> None:
        self.engine = new_engine(streamed(), 48000, StrikeRing())
        assert self.engine.stream is not None
        self.feed = Feed(self.engine.stream)
        self.now_ns = now_ns
        self.step_s = float(self.engine.control["divisor"][0]) / 48000.0
        self.sounds: list[np.ndarray] = []

    @property
    def state(self) -> StreamState:
        """The timeline's STATE record."""
        assert self.engine.stream is not None
        return self.engine.stream.state[0]

    def push(self, first: int, forces, ahead_ns: int, rate_Hz: float, epoch: int = 1) -> None:
        """Samples whose first begins ahead_ns from now."""
        self.push_at(first, forces, self.now_ns + ahead_ns, rate_Hz, epoch)

    def push_at(self, first: int, forces, start_ns: int, rate_Hz: float, epoch: int = 1) -> None:
        """Samples whose first begins at start_ns."""
        given = np.asarray(forces, np.float32)
        assert self.feed.push(epoch, first, start_ns, 1e9 / rate_Hz, 0.3, 0.1, given)

    def play(self, span_ns: int) -> np.ndarray:
        """Mean force, N, over each step of the mesh in the next span_ns or a little more."""
        found: list[np.ndarray] = []
        end_ns = self.now_ns + span_ns
        while self.now_ns < end_ns:
            out = np.zeros(_STEPS)
            pressed(self.engine, self.now_ns, out)
            self.now_ns += round(_STEPS * self.step_s * 1e9)
            found.append(out)
        self.sounds += found
        return np.concatenate(found) if found else np.zeros(0)
