"""Cost of composing: a scene without effects beside the step that one would write by hand for just that drum.

A scene gets its step by leaving out, when it is compiled, whatever it does not name. By hand it is a sweep of the mesh,
the blows that last, two pickups, a look now and then whether it still sounds. It stands for the same drum when it takes
as many overlapping blows (32). Both use the same row kernel and must give the same samples. Any thread.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.build import new_engine
from drumstick.drum.engine import Control, Engine
from drumstick.drum.excitation.analytic import begin
from drumstick.drum.membrane.heads import aligned
from drumstick.drum.membrane.interpolation import corners_of
from drumstick.drum.membrane.rows import step_of
from drumstick.drum.membrane.simd import WIDTH
from drumstick.drum.membrane.sweep import bare
from drumstick.drum.membrane.terms import LEFT, StripBounds
from drumstick.drum.memory.pulses import POOL, PULSE, ContactPulse
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.step import step
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.drums.heads import DEVICE_RATE_Hz
from drumstick_lab.accuracy.timing import Window, spent_ns
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit
from realtime.records import Records

GOAL = 1.03  # of what is written by hand: no effects cost no effects
PLACE = (0.3, 0.2)
_UPDATES = 4e6  # of junctions in a window
_NOISE = 1e-3
Floats = npt.NDArray[np.float32]
_strip = step_of(WIDTH, LEFT)


class Drum(NamedTuple):
    """The drum by hand: what a step needs, and no more."""

    time_levels: Floats
    weights: Floats
    strips: npt.NDArray[np.int64]
    stride: int
    u_gain: np.float32
    u_old_gain: np.float32
    blows: Records  # (n,) of PULSE, all at one junction
    junction: int
    force_gain: float
    pickups: npt.NDArray[np.int64]
    gains: Floats


@njit()
def by_hand(drum: Drum, out: Floats) -> None:
    """So many steps as `out` (n, 2) has rows, an even number."""
    time_levels = drum.time_levels
    mode = flush_denormals()
    loudest = np.float32(0.0)
    for at in range(out.shape[0]):
        u, u_old = time_levels[at & 1], time_levels[1 - (at & 1)]
        for k in range(drum.strips.shape[0]):
            bounds = StripBounds(
                drum.stride, drum.strips[k, 0], drum.strips[k, 1], drum.strips[k, 2], drum.strips[k, 3]
            )
            _strip(u, u_old, drum.weights, bounds, bare(drum.u_gain, drum.u_old_gain))
        u_new = u_old  # the sweep has put u+ in the place of u-
        for k in range(drum.blows.shape[0]):
            blow: ContactPulse = drum.blows[k]
            if blow.age < blow.duration:
                scale, decay, phase = blow.turn / blow.duration, blow.decay, blow.phase
                begun = scale * min(max(blow.age, 0.0), blow.duration)
                ended = scale * min(max(blow.age + 1.0, 0.0), blow.duration)
                before = math.exp(-decay * begun) * (
                    decay * math.sin(begun + phase) + math.cos(begun + phase)
                )
                after = math.exp(-decay * ended) * (decay * math.sin(ended + phase) + math.cos(ended + phase))
                force = blow.size / scale * (before / (1.0 + decay * decay) - after / (1.0 + decay * decay))
                u_new[drum.junction] += np.float32(drum.force_gain * force)
                blow.age += 1.0
        left = right = 0.0
        for k in range(drum.pickups.shape[0]):
            moved = float(u_new[drum.pickups[k]] - u[drum.pickups[k]])
            left += drum.gains[k, 0] * moved
            right += drum.gains[k, 1] * moved
        out[at, 0], out[at, 1] = left, right
        if at % 4096 == 4095:
            for k in range(u_new.shape[0]):
                loudest = max(loudest, abs(u_new[k]), abs(u[k]))
    restore(mode)


@njit()
def composed(engine: Engine, out: Floats) -> None:
    """Several of the scene's own steps."""
    engine = borrowed_view(engine)
    mode = flush_denormals()
    for at in range(out.shape[0]):
        left, right = step(engine)
        out[at, 0], out[at, 1] = left, right
    restore(mode)


def drum_of(engine: Engine, x: float, y: float, blows: int) -> Drum:
    """Copy of the engine's drum, moving alike, with time levels of its own."""
    control: Control = engine.control[0]
    head = engine.head
    time_levels = aligned(head.time_levels.shape)
    time_levels[:] = head.time_levels
    places, shares = corners_of(head, x, y)
    junction = places[int(np.argmax(shares))]
    return Drum(
        time_levels=time_levels,
        weights=head.weights,
        strips=head.strips,
        stride=int(head.grid["stride"][0]),
        u_gain=control["u_gain"],
        u_old_gain=control["u_old_gain"],
        blows=np.zeros(blows, PULSE),
        junction=junction,
        force_gain=float(head.weights[junction]) * float(control["force_gain"]),
        pickups=engine.pickups,
        gains=engine.pickup_gains,
    )


class Race:
    """One drum composed, and by hand with so many overlapping blows each; all play the same.

    `windows` give ns a step; `check` after a round: AssertionError if the drums do not sound the same.
    """

    def __init__(self, scene: Scene, blows: Sequence[int] = (POOL,)) -> None:
        self.engine = new_engine(scene, DEVICE_RATE_Hz, StrikeRing())
        inside = self.engine.head.weights > 0.0
        for u, seed in zip(self.engine.head.time_levels, (1, 2), strict=True):
            u[inside] = np.random.default_rng(seed).standard_normal(int(inside.sum())) * _NOISE
        self.drums = [drum_of(self.engine, *PLACE, most) for most in blows]
        self.junctions = int(inside.sum())
        self.steps = 2 * max(10, round(_UPDATES / self.junctions / 2))
        self._sounds = [np.zeros((self.steps, 2), np.float32) for _ in range(len(blows) + 1)]

    @property
    def windows(self) -> list[Window]:
        """Composed first, then by hand, in the order of `blows`."""
        return [self._composed, *(self._of_hand(at) for at in range(len(self.drums)))]

    def _composed(self) -> float:
        # A blow of four steps at the beginning of each window, as in the others.
        control: Control = self.engine.control[0]
        control["begun"] = begin(self.engine.pulses, int(control["begun"]), *PLACE, 0.0, 4.0, 1e-3)
        return spent_ns(lambda: composed(self.engine, self._sounds[0])) / self.steps

    def _of_hand(self, at: int) -> Window:
        drum, out = self.drums[at], self._sounds[1 + at]

        def window() -> float:
            begin(drum.blows, 0, *PLACE, 0.0, 4.0, 1e-3)
            return spent_ns(lambda: by_hand(drum, out)) / self.steps

        return window

    def run(self, rounds: int) -> list[tuple[float, ...]]:
        """ns a step of each window in so many rounds, after one that is not counted; each round is checked."""
        found: list[tuple[float, ...]] = []
        for _ in range(rounds + 1):
            found.append(tuple(window() for window in self.windows))
            self.check()
        return found[1:]

    def check(self) -> None:
        """The sounds of the last round are the same, sample by sample, and not silence."""
        first, *others = self._sounds
        assert first.any(), "silence"
        assert all(np.array_equal(first, other) for other in others), "not the same drum"
