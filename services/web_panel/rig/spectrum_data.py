"""Spectrum of the sound server's drum, as numbers to draw. Pure."""

import numpy as np
import numpy.typing as npt

from protocol.messages import Spectrum

Numbers = npt.NDArray[np.float64]
Pair = tuple[Numbers, Numbers]

FLOOR_dB, TOP_dB = -100.0, 0.0
# Zeros of the Bessel functions J_m over the first one of J_0, in their order (Abramowitz and Stegun, table 9.5).
RATIOS = (
    1.0, 1.5933, 2.1355, 2.2954, 2.6531, 2.9173, 3.1555, 3.5001, 3.5985, 3.6475, 4.0589, 4.1317, 4.2304, 4.6010,
    4.6101, 4.8319, 4.9033, 5.0836, 5.1308, 5.4121,
)  # fmt: skip


def levels_of(heard: Spectrum) -> Pair:
    """Frequencies (Hz) and levels (dB), shape (n,). ValueError for a message that holds something else."""
    levels = np.frombuffer(heard.levels, "<f4").astype(np.float64)
    if not (2 <= len(levels) <= 4096 and np.isfinite(levels).all() and heard.top_Hz > 0.0):
        raise ValueError(f"a spectrum of {len(levels)} levels up to {heard.top_Hz} Hz cannot be shown")
    return np.linspace(0.0, heard.top_Hz, len(levels)), np.maximum(levels, FLOOR_dB)


def marks(f01_Hz: float, top_Hz: float) -> Pair:
    """A comb: up to the top at each ideal mode's frequency, at the floor between."""
    modes = f01_Hz * np.array(RATIOS)
    modes = modes[modes < top_Hz]
    hair = 1e-4 * top_Hz
    at = np.concatenate([modes - hair, modes, modes + hair])
    height = np.concatenate(
        [np.full(len(modes), FLOOR_dB), np.full(len(modes), TOP_dB), np.full(len(modes), FLOOR_dB)]
    )
    order = np.argsort(at, kind="stable")
    return np.append(np.append(0.0, at[order]), top_Hz), np.append(
        np.append(FLOOR_dB, height[order]), FLOOR_dB
    )
