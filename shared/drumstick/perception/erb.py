"""Sounds as an ear resolves them: levels in bands of equal rectangular width (ERB), and how far two of them differ.

Bands by Glasberg, Moore, "Derivation of auditory filter shapes from notched-noise data", 1990. Magnitudes only: phases
of two heads drift apart by the slightest detuning, which is not heard. Any thread; allocates.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

_FRAME_S = 0.043
_HEARD_dB = 60.0  # below the loudest band of the sound: what is softer is masked, or nobody listens to it
_FIRST, _LAST = 2, 39  # numbers of bands, 55 Hz to 15 kHz

Numbers = npt.NDArray[np.float64]


def erb_number(f_Hz: npt.ArrayLike) -> Numbers:
    """Number of the band that holds a frequency: 15.6 at 1 kHz, 33.2 at 8 kHz."""
    return 21.4 * np.log10(1.0 + 0.00437 * np.asarray(f_Hz, np.float64))


def band_levels(sound: npt.NDArray[Any], rate_Hz: float) -> Numbers:
    """Level in dB of each frame of 43 ms and band, shape (frames, bands); sound has shape (n,)."""
    width = round(_FRAME_S * rate_Hz)
    frames = np.lib.stride_tricks.sliding_window_view(np.asarray(sound, np.float64), width)[:: width // 2]
    power = np.abs(np.fft.rfft(frames * np.hanning(width))) ** 2
    band = np.floor(erb_number(np.fft.rfftfreq(width, 1.0 / rate_Hz))).astype(int)
    summed = np.array([power[:, band == number].sum(axis=1) for number in range(_FIRST, _LAST)]).T
    return 10.0 * np.log10(summed + np.finfo(np.float64).tiny)


def spectral_distance(
    sound: npt.NDArray[Any], wanted: npt.NDArray[Any], rate_Hz: float, below_Hz: float = np.inf
) -> float:
    """Log-spectral distance in dB: rms difference of the levels of all bands and frames that are heard in `wanted`.

    Nothing is taken for masked that is within 60 dB of the loudest: an upper bound of what is heard. below_Hz: of bands
    that begin below it alone.
    """
    own, due = band_levels(sound, rate_Hz), band_levels(wanted, rate_Hz)
    floor = due.max() - _HEARD_dB
    heard = (due > floor) & (np.arange(_FIRST, _LAST) < erb_number(below_Hz))
    return float(np.sqrt(np.mean((np.maximum(own, floor) - due)[heard] ** 2)))
