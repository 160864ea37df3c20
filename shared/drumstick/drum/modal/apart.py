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

Low modes that ring loudest next to the boundary do swing the pull at twice the frequency of those beyond, which gain
what nobody loses. So the bank's energy is summed with each mean; where it has grown, all modes go step by step for a
while (docs/decisions/0060).

What of a mode is in the blocks and what not is a matter of steps counted from the drum's first: the length of audio
blocks changes no bit. Kernels: audio thread; no allocation.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import tension
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
_GROWTH = 1e-4  # of the energy: strokes on the shipped toms leave at most 1.3e-5
_WHOLE_STEPS = 65_536  # 1.4 s at 48 kHz, in sleep too
_TINY = np.float32(1e-12)  # for the oscillators at rest that fill the last tile


@njit(fastmath={"contract", "reassoc"})
def _summed(
    stretch_weights: Floats,
    tension_stiffness: Floats,
    q: Floats,
    d: Floats,
    r_squared: Floats,
    stiffness: Floats,
    pull: np.float32,
) -> tuple[float, float, float]:
    # Mean stretch, stretch now, and energy of some modes: (1 + R^2) d^2/4 + k q q-/2, times their masses over R^2.
    quarter, half, one = np.float32(0.25), np.float32(0.5), np.float32(1.0)
    two, four = np.float32(2.0), np.float32(4.0)
    mean = stretch = energy = np.float32(0.0)
    for i in range(q.shape[0]):
        r2, by_tension, products = r_squared[i], r_squared[i] * tension_stiffness[i], q[i] * (q[i] - d[i])
        own = max(stiffness[i] + pull * by_tension, _TINY)
        below = own * (four - own)
        share = stretch_weights[i] / (max(by_tension, _TINY) * below)  # one division for both
        mean += share * by_tension * (d[i] * d[i] + own * products) * (two - own)
        stretch += stretch_weights[i] * products
        energy += share * below * (quarter * (d[i] * d[i]) * (one + r2) + half * (stiffness[i] * products))
    return float(mean), float(stretch), float(energy)


@njit()
def _sums(modes: Bank, pull: float, begin: int, end: int) -> tuple[float, float, float]:
    mean = stretch = energy = 0.0
    for first in range(begin, end, _PART):
        last = min(first + _PART, end)
        part = _summed(
            modes.stretch_weights[first:last],
            modes.tension_stiffness[first:last],
            modes.q[first:last],
            modes.d[first:last],
            modes.r_squared[first:last],
            modes.stiffness[first:last],
            np.float32(pull),
        )
        mean += part[0]
        stretch += part[1]
        energy += part[2]
    return mean, stretch, energy


@njit()
def mean_stretch(modes: Bank, pull: float, begin: int, end: int) -> float:
    """Mean of what these modes stretch the head by, under a pull that stays."""
    mean, _, _ = _sums(modes, pull, begin, end)
    return mean


@njit()
def mean_and_energy(engine: "Engine") -> tuple[float, float]:
    """Mean stretch of all modes but the lowest, and the energy of bank and tension, in the bank's units."""
    modes, lowest, radial_modes = engine.modal, engine.blocks.state[0].lowest, engine.modal.orders.shape[0]
    tight: TensionState = engine.effects.tension.state[0]
    mean = stretched = energy = 0.0
    for first, last in ((0, radial_modes), (radial_modes, modes.q.shape[0])):
        _, low_stretch, low_energy = _sums(modes, tight.pull, first, first + lowest)
        high_mean, high_stretch, high_energy = _sums(modes, tight.pull, first + lowest, last)
        mean += high_mean
        stretched += low_stretch + high_stretch
        energy += low_energy + high_energy
    return mean, energy + tension.energy(tight, stretched)


@only_with("tension", otherwise=False)
def is_under_tension(engine: "Engine") -> bool:
    """True where a tension couples the modes."""
    return True


@only_with("tension", otherwise=STEPS)
def steps_undriven(engine: "Engine") -> int:
    """Coming steps of one mean, less those in which a pulse acts and all after them; 0 while all go step by step."""
    control, pulses = engine.control[0], engine.pulses
    if control.steps < engine.blocks.state[0].whole_until:
        return 0
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


@njit()
def _has_grown(engine: "Engine", energy: float) -> bool:
    # True where the blocks have given the bank energy: then it goes step by step for a while.
    state: BlockState = engine.blocks.state[0]
    if state.apart != 0 and not energy <= (1.0 + _GROWTH) * state.energy:  # nor where it is no number
        state.whole_until = engine.control[0].steps + _WHOLE_STEPS
        return True
    return False


@njit()
def _begin_cell(engine: "Engine") -> bool:
    # Take the mean anew; False where all modes are to go step by step.
    state: BlockState = engine.blocks.state[0]
    mean, energy = mean_and_energy(engine)
    if _has_grown(engine, energy):
        state.apart = 0
        stretch.look(engine)
        return False
    state.energy = energy if state.apart == 0 else min(energy, state.energy)
    # Modes that a pull raises above a quarter cycle a step have a negative mean: by it the head would be torn apart.
    state.mean_stretch, state.apart = max(mean, 0.0), 1
    _look(engine)
    return True


@only_with("tension")
def run(engine: "Engine", steps: int) -> None:
    """Take so many steps, at most those of `steps_undriven`, or none where blocks have made energy;
    `blocks.handed_out` tells them."""
    state: BlockState = engine.blocks.state[0]
    modes, heard, pulls = engine.modal, engine.blocks.heard, engine.blocks.pulls
    lowest_heard = engine.blocks.lowest_heard
    lowest, radial_modes, size = state.lowest, modes.orders.shape[0], modes.q.shape[0]
    begins = state.apart == 0 or engine.control[0].steps % CELL == 0
    if begins and not _begin_cell(engine):
        return
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
        _, energy = mean_and_energy(engine)
        _has_grown(engine, energy)
        state.apart = 0
        stretch.look(engine)
