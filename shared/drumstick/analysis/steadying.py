"""A simulated drummer who holds an unstable roll: equation (8)'s factor kept at 1 by the grip.

Where a roll is unstable a strike that is too hard makes the next one harder still, and one that is too soft the next
one softer. The drummer hears each strike, and after a reaction time grips so that R_out, and with it alpha,
takes from a roll that is too loud: R_out (1 + gain (v/v* - 1)) (1 + noise), v the strike heard, v* the one that is
meant, noise normal, new with every strike. Any thread; blocks for tenths of a second once compiled.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.cycles.return_step import scratch_of, set_state
from drumstick.analysis.findings import analyse
from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit

_SOFTEST, _LOUDEST = (
    0.8,
    1.25,
)  # of the strike that is meant: beyond, the roll is lost, or has become another one
_TIGHTEST = 10.0  # of the scene's R_out
_WAITING = 64  # strikes that a drummer has heard and not answered yet; more are not heard


@dataclass(frozen=True)
class Drummer:
    """reaction_s: from a strike to the grip that answers it; gain: relative change of R_out over that of the strike;
    noise: standard deviation of the grip, of its own size.
    """

    reaction_s: float
    gain: float
    noise: float = 0.05


@njit()
def _held_s(
    law: Law,
    motion: Motion,
    meant: float,
    reaction_s: float,
    gain: float,
    noises: npt.NDArray[np.float64],
    most_s: float,
) -> float:
    # For how long, s, the roll stays within its bounds.
    own, t, heard, answered, strikes = law.r_out, 0.0, 0, 0, 0
    due, grips = np.zeros(_WAITING), np.zeros(_WAITING)
    while t < most_s and strikes < noises.shape[0]:
        until = due[answered % _WAITING] if answered < heard else most_s
        event, moved = exact.advance(law, motion, max(until - t, 0.0))
        t += moved
        if motion.outcome != exact.MOVING:
            return t
        if event == exact.ENTRY:
            loud = -motion.v_in / meant
            if not _SOFTEST < loud < _LOUDEST:
                return t
            if heard - answered < _WAITING:
                grip = (1.0 + gain * (loud - 1.0)) * (1.0 + noises[strikes])
                due[heard % _WAITING] = t + reaction_s
                grips[heard % _WAITING] = min(max(grip, 0.0), _TIGHTEST)
                heard += 1
            strikes += 1
        elif event == exact.HORIZON and answered < heard:
            law.r_out = own * grips[answered % _WAITING]
            answered += 1
    return most_s


def unstable_roll(scene: Scene) -> Cycle:
    """The scene's loudest even roll that small errors end. ValueError where there is none."""
    found = [cycle for cycle in analyse(scene).cycles if not cycle.stable and cycle.period == 1]
    if not found:
        raise ValueError(f"{scene.name} has no even roll that is unstable")
    return found[-1]


def held_s(
    scene: Scene, roll: Cycle, drummer: Drummer, seed: int, most_s: float = 20.0, off: float = 0.01
) -> float:
    """For how long (s, at most `most_s`) the drummer holds the roll that begins `off` (relative) too fast."""
    law, scratch = law_of(scene), scratch_of(scene)
    state = np.array(roll.states[0])
    state[0] *= 1.0 + off
    set_state(law[0], scratch[1:2], scratch[0:1], state)
    noises = drummer.noise * np.random.default_rng(seed).standard_normal(int(200.0 * most_s))
    meant = -roll.v_in_m_per_s
    return float(_held_s(law[0], scratch[0], meant, drummer.reaction_s, drummer.gain, noises, most_s))


def share_held(scene: Scene, roll: Cycle, drummer: Drummer, tries: int, most_s: float = 20.0) -> float:
    """Share of so many tries, 0 .. 1, in which the drummer holds the roll for all of `most_s`."""
    return float(np.mean([held_s(scene, roll, drummer, seed, most_s) >= most_s for seed in range(tries)]))
