"""From the mesh's rate to the device's: a polyphase windowed-sinc interpolator by a whole number.

The delay is half the filter: TAPS/2 steps of the mesh.
"""

import numpy as np
import numpy.typing as npt

from realtime.kernels.jit import njit

TAPS = 24  # per phase
_KAISER_BETA = 8.0  # 80 dB below in the stop band
_CUTOFF = 0.45  # of the mesh rate; images 80 dB down from 0.55
PASS_BAND = 0.36  # of the mesh rate


def interpolator(factor: int) -> npt.NDArray[np.float32]:
    """Coefficients, shape (factor, TAPS): phase p gives the p-th device sample after a mesh step, gain 1 at 0 Hz.

    Every phase is scaled by itself, so a constant comes out constant instead of as a tone at the mesh rate.
    """
    length = factor * TAPS
    offset = np.arange(length) - length / 2.0
    window = np.kaiser(length + 1, _KAISER_BETA)[:length]
    response = 2.0 * _CUTOFF * np.sinc(2.0 * _CUTOFF * offset / factor) * window
    phases = response.reshape(TAPS, factor).T
    return np.ascontiguousarray(phases / phases.sum(axis=1, keepdims=True), dtype=np.float32)


@njit()
def remember(history: npt.NDArray[np.float32], head: int, left: float, right: float) -> int:
    """Store a mesh sample, newest first; returns the new head. `history` has shape (2, 2 TAPS), every sample twice,
    so that the newest TAPS always lie in a row."""
    head = (head - 1) % TAPS
    history[0, head] = history[0, head + TAPS] = np.float32(left)
    history[1, head] = history[1, head + TAPS] = np.float32(right)
    return head


@njit(fastmath={"contract", "reassoc"})
def interpolated(
    history: npt.NDArray[np.float32], head: int, channel: int, phase: npt.NDArray[np.float32]
) -> float:
    """The channel's sample at one phase. No allocation."""
    recent = history[channel, head : head + TAPS]
    total = np.float32(0.0)
    for k in range(TAPS):
        total += recent[k] * phase[k]
    return float(total)
