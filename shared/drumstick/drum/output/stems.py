"""Pairs of single pickups or microphones, beside the mix of the others: filled step by step, as the mix is.

Everything that is heard of a head is a sum over its pickups, so taking one out of the mix changes nothing else: the
sum of all pairs is the mix that there would be without. Kernels: audio thread; no allocation. A drum without stems
compiles none of this.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.memory.stems import Stems
from drumstick.drum.output.upsample import TAPS, interpolated
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine


@only_with("stems", otherwise=2)
def width(engine: "Engine") -> int:
    """Channels of a drum's blocks: two for the mix, and two for each stem. For compiled code."""
    return int(2 + engine.stems.now.shape[0])


@njit()
def _add(stems: Stems, gains: npt.NDArray[np.float64], signal: float) -> None:
    for channel in range(stems.now.shape[0]):
        stems.now[channel] += gains[channel] * signal


@only_with("stems")
def add_microphone(engine: "Engine", number: int, signal: float) -> None:
    """One step of what a microphone hears."""
    _add(engine.stems, engine.stems.microphones[number], signal)


@only_with("stems")
def add_pickup(engine: "Engine", corner: int, signal: float) -> None:
    """One step of the movement at one of the corners that pickups hear."""
    _add(engine.stems, engine.stems.pickups[corner], signal)


@only_with("stems")
def add_second(engine: "Engine", corner: int, signal: float) -> None:
    """One step of the movement at one of the corners that pickups hear on the second head."""
    _add(engine.stems, engine.stems.second[corner], signal)


@only_with("stems")
def add_moved(engine: "Engine", mode: int, signal: float) -> None:
    """One step of a mode that is moved on the mesh: pickups hear too much of it."""
    for channel in range(engine.stems.now.shape[0]):
        engine.stems.now[channel] -= engine.stems.moved[channel, mode] * signal


@njit(fastmath={"contract", "reassoc"})
def _heard(values: npt.NDArray[np.float32], gains: npt.NDArray[np.float32]) -> float:
    total = np.float32(0.0)
    for i in range(values.shape[0]):
        total += gains[i] * values[i]
    return float(total)


@only_with("stems")
def add_modes(engine: "Engine") -> None:
    """One step of a bank, after it was taken."""
    stems, bank = engine.stems, engine.modal
    for channel in range(stems.movement.shape[0]):
        stems.now[channel] += _heard(bank.d, stems.movement[channel])
    for channel in range(stems.place.shape[0]):
        stems.now[channel] += _heard(bank.q, stems.place[channel])


@only_with("stems")
def remember(engine: "Engine", head: int) -> None:
    """Store the step's sums where the mix has its own, and begin anew."""
    stems = engine.stems
    for channel in range(stems.now.shape[0]):
        stems.history[channel, head] = stems.history[channel, head + TAPS] = np.float32(stems.now[channel])
        stems.now[channel] = 0.0


@only_with("stems", otherwise=(0.0, 0.0))
def fill(
    engine: "Engine",
    out: npt.NDArray[np.float32],
    phase: npt.NDArray[np.float32],
    gains: tuple[float, float],
) -> Any:
    """Write one sample of each channel into `out`, (2 + 2 S,), after the mix; returns their sum, left and right, as
    `gains` are."""
    control, history = engine.control[0], engine.stems.history
    left = right = 0.0
    for channel in range(0, history.shape[0], 2):
        on_left = gains[0] * control.output_gain * interpolated(history, control.history_head, channel, phase)
        on_right = (
            gains[1] * control.output_gain * interpolated(history, control.history_head, channel + 1, phase)
        )
        out[2 + channel], out[3 + channel] = on_left, on_right
        left += on_left
        right += on_right
    return left, right
