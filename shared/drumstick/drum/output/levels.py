"""Gain, balance and mute of a drum, as they are set while it plays: a glide, so that no change clicks.

Levels follow their targets through two low-passes one after the other, a step a block, and move in a straight line
within it. A jump would spread over the whole spectrum, falling 6 dB an octave; this falls 18 above 1/(2 pi T), 32 Hz.
Kernels: audio thread; no allocation, no locks. `target`: written by the thread that receives it.
"""

import math

from drumstick.drum.memory.listening import Levels, Listening, ListenTargets
from realtime.kernels.jit import njit

_T_S = 0.005  # of each of the two: the way from one level to the other takes some 40 ms
_NEAR = 1e-6  # 120 dB down a level has arrived


@njit()
def levels_of(target: ListenTargets) -> tuple[float, float]:
    """Factors of left and right. In the middle both are 1; a mute of 1 is exactly 0."""
    gain = 10.0 ** (target.listen_gain / 20.0) * (1.0 - target.listen_mute)
    return gain * min(1.0, 1.0 - target.listen_pan), gain * min(1.0, 1.0 + target.listen_pan)


@njit()
def settle(listening: Listening, gain_dB: float, pan: float, mute: float) -> None:
    """Be there at once, before anything is heard."""
    target: ListenTargets = listening.target[0]
    target.listen_gain, target.listen_pan, target.listen_mute = gain_dB, pan, mute
    settle_as_set(listening)


@njit()
def settle_as_set(listening: Listening) -> None:
    """Be at once where the targets are, before anything is heard."""
    target: ListenTargets = listening.target[0]
    levels: Levels = listening.levels[0]
    levels.left, levels.right = levels_of(target)
    levels.left_ahead, levels.right_ahead = levels.left, levels.right


@njit()
def _followed(level: float, goal: float, share: float) -> float:
    return goal if abs(goal - level) <= _NEAR else level + share * (goal - level)


@njit()
def glide(listening: Listening, frames: int, rate_Hz: float) -> None:
    """Move the levels on by a block of so many frames."""
    levels: Levels = listening.levels[0]
    left, right = levels_of(listening.target[0])
    if levels.left == levels.left_ahead == left and levels.right == levels.right_ahead == right:
        return
    share = 1.0 - math.exp(-frames / (_T_S * rate_Hz))
    levels.left_ahead = _followed(levels.left_ahead, left, share)
    levels.right_ahead = _followed(levels.right_ahead, right, share)
    levels.left = _followed(levels.left, levels.left_ahead, share)
    levels.right = _followed(levels.right, levels.right_ahead, share)
