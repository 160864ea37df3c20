"""A bank under tension while it rings: the lowest modes step by step, all others in blocks under the pulls these found.

A step's pull follows from how much the head is stretched (drumstick.drum.modal.stretch), a sum over all modes: of each
its mean, and an oscillation at twice its frequency. While something drives the head all modes are summed in each step.
While nothing does, the low ones swing the tension and are summed as before; of the others, thousands, the oscillations
cancel, and for CELL steps they count by their mean. Known then are the pulls of these steps, and the many modes take
them in blocks.

The mean of a mode goes by its invariant. With K the stiffness that it has under the pull g, a step at constant g keeps
I = d^2 + K q q-, and q+ q has the mean I (2 - K)/(K (4 - K)). It does not oscillate with the mode: a stretch that did,
and came late, would pump it (drumstick.drum.effects.tension). So what pulls a high mode has nothing near twice its
frequency, its action stays, and its energy follows the square root of the tension, as in a string that is tuned while
it sounds. The low modes and the tension lose and gain together exactly, as in every step.

What of a mode is in the blocks and what not is a matter of steps counted from the drum's first: the length of audio
blocks changes no bit. Kernels: audio thread; no allocation.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drumstick.drum.memory.bank import CELL, STEPS, Bank
from drumstick.drum.modal import blocks, stretch
from drumstick.drum.modal.bank import step_modes
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.effects.tension import TensionState
    from drumstick.drum.engine import Engine
    from drumstick.drum.memory.bank import BlockState
    from drumstick.drum.memory.pulses import ContactPulse

Floats = npt.NDArray[np.float32]
_PART = 1024  # modes, whose sums single precision holds
_TINY = np.float32(1e-12)  # for the oscillators at rest that fill the last tile


@njit(fastmath={"contract", "reassoc"})
def _mean(
    stretch_weights: Floats,
    tension_stiffness: Floats,
    q: Floats,
    d: Floats,
    r_squared: Floats,
    stiffness: Floats,
    pull: np.float32,
) -> float:
    two, four, total = np.float32(2.0), np.float32(4.0), np.float32(0.0)
    for i in range(q.shape[0]):
        own = max(stiffness[i] + pull * (r_squared[i] * tension_stiffness[i]), _TINY)
        invariant = d[i] * d[i] + own * (q[i] * (q[i] - d[i]))
        total += stretch_weights[i] * invariant * ((two - own) / (own * (four - own)))
    return float(total)


@njit()
def mean_stretch(modes: Bank, pull: float, begin: int, end: int) -> float:
    """Mean of what these modes stretch the head by, under a pull that stays."""
    total = 0.0
    for first in range(begin, end, _PART):
        last = min(first + _PART, end)
        total += _mean(
            modes.stretch_weights[first:last],
            modes.tension_stiffness[first:last],
            modes.q[first:last],
            modes.d[first:last],
            modes.r_squared[first:last],
            modes.stiffness[first:last],
            np.float32(pull),
        )
    return total


@only_with("tension", otherwise=False)
def is_under_tension(engine: "Engine") -> bool:
    """True where a tension couples the modes."""
    return True


@only_with("tension", otherwise=STEPS)
def steps_undriven(engine: "Engine") -> int:
    """Coming steps of one mean, less those in which a pulse acts and all after them."""
    control, pulses = engine.control[0], engine.pulses
    steps = CELL - control.steps % CELL
    if control.active == 0 and control.begun_at_last_scan == control.begun:
        return int(steps)
    for i in range(pulses.shape[0]):
        pulse: ContactPulse = pulses[i]
        if pulse.age < pulse.duration:
            steps = min(steps, max(0, math.floor(-pulse.age)))
    return int(steps)


@njit()
def _look(engine: "Engine") -> None:
    # The coming step's equation: the lowest modes, and the mean of the others.
    state, modes = engine.blocks.state[0], engine.modal
    tight: TensionState = engine.effects.tension.state[0]
    radial_modes = modes.orders.shape[0]
    tight.before, tight.x, tight.y = state.mean_stretch, 0.0, 0.0
    stretch.add_modes(modes, tight, 0, state.lowest)
    stretch.add_modes(modes, tight, radial_modes, radial_modes + state.lowest)


@only_with("tension")
def run(engine: "Engine", steps: int) -> None:
    """Take so many steps, at most those of `steps_undriven`; `blocks.handed_out` tells them."""
    state: BlockState = engine.blocks.state[0]
    modes, heard, pulls = engine.modal, engine.blocks.heard, engine.blocks.pulls
    lowest_heard = engine.blocks.lowest_heard
    lowest, radial_modes, size = state.lowest, modes.orders.shape[0], modes.q.shape[0]
    if state.apart == 0 or engine.control[0].steps % CELL == 0:
        pull = engine.effects.tension.state[0].pull
        state.mean_stretch = mean_stretch(modes, pull, lowest, radial_modes) + mean_stretch(
            modes, pull, radial_modes + lowest, size
        )
        state.apart = 1
        _look(engine)
    for n in range(steps):
        pull = stretch.pull(engine)
        pulls[n] = np.float32(pull)
        left, right = step_modes(modes, pull, 0, lowest)
        also_left, also_right = step_modes(modes, pull, radial_modes, radial_modes + lowest)
        lowest_heard[n, 0], lowest_heard[n, 1] = left + also_left, right + also_right
        _look(engine)
    blocks.run_modes(engine, lowest, radial_modes, 0, steps)
    for n in range(steps):
        lowest_heard[n, 0] += heard[n, 0]
        lowest_heard[n, 1] += heard[n, 1]
    blocks.run_modes(engine, radial_modes + lowest, size, 0, steps)
    for n in range(steps):
        heard[n, 0] += np.float32(lowest_heard[n, 0])
        heard[n, 1] += np.float32(lowest_heard[n, 1])
    blocks.hand_out(engine, steps)


@only_with("tension")
def rejoin(engine: "Engine") -> None:
    """Sum all modes for a step that is taken one by one."""
    state: BlockState = engine.blocks.state[0]
    if state.apart != 0:
        state.apart = 0
        stretch.look(engine)
