"""Two sounds of one drum beside each other: levels by octave with their sign, pitch and decay mode by mode. Pure."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

OCTAVES_Hz = (125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)  # centres
_HEARD_dB = 60.0  # below the loudest octave
_WINDOW_S, _BEGIN_S, _APART_S = 0.6, 0.05, 0.4
_NEPERS = math.log(1000.0)
Numbers = npt.NDArray[np.float64]


def octave_levels(sound: npt.NDArray[np.floating], rate_Hz: float) -> Numbers:
    """Level of the whole sound, shape (n,), in each octave, dB."""
    power = np.abs(np.fft.rfft(np.asarray(sound, np.float64))) ** 2
    f_Hz = np.fft.rfftfreq(len(sound), 1.0 / rate_Hz)
    half = math.sqrt(2.0)
    bands = [power[(f_Hz >= centre / half) & (f_Hz < centre * half)].sum() for centre in OCTAVES_Hz]
    return 10.0 * np.log10(np.array(bands) + np.finfo(np.float64).tiny)


def louder_dB(sound: npt.NDArray[np.floating], wanted: npt.NDArray[np.floating]) -> float:  # noqa: N802
    """By how many dB a sound is louder as a whole."""
    own, due = (float(np.sum(np.asarray(each, np.float64) ** 2)) for each in (sound, wanted))
    return 10.0 * math.log10(own / due)


def brighter_dB(  # noqa: N802
    sound: npt.NDArray[np.floating], wanted: npt.NDArray[np.floating], rate_Hz: float
) -> list[float | None]:
    """By how many dB each octave of a sound is too loud when the whole is as loud as it should be; below 0: too soft.
    None where the wanted one is 60 dB below its loudest octave."""
    own, due = octave_levels(levelled(sound, wanted), rate_Hz), octave_levels(wanted, rate_Hz)
    return [
        float(one - other) if other > due.max() - _HEARD_dB else None
        for one, other in zip(own, due, strict=True)
    ]


def levelled(sound: npt.NDArray[np.floating], wanted: npt.NDArray[np.floating]) -> Numbers:
    """The sound by one factor, so that both have the same power."""
    return np.asarray(sound, np.float64) * 10.0 ** (-louder_dB(sound, wanted) / 20.0)


def mode_by_mode(
    sound: npt.NDArray[np.floating],
    wanted: npt.NDArray[np.floating],
    f_Hz: Sequence[float],
    t60_s: Sequence[float],
    rate_Hz: float,
) -> tuple[Numbers, Numbers]:
    """Pitch in cents and relative T60 by which each mode of a sound is off, by how its ratio to the wanted sound's turns
    and fades between two windows. Both are struck at once before _BEGIN_S, and never again."""
    width, first, apart = (round(each * rate_Hz) for each in (_WINDOW_S, _BEGIN_S, _APART_S))
    window = np.hanning(width)
    cents, decays = np.zeros(len(f_Hz)), np.zeros(len(f_Hz))
    for at, (f, t60) in enumerate(zip(f_Hz, t60_s, strict=True)):
        wave = window * np.exp(-2j * math.pi * f / rate_Hz * np.arange(width))
        early, late = (
            complex(wave @ sound[begin : begin + width]) / complex(wave @ wanted[begin : begin + width])
            for begin in (first, first + apart)
        )
        turned, kept = float(np.angle(late / early)) / _APART_S, math.log(abs(late / early)) / _APART_S
        cents[at] = 1200.0 * math.log2(1.0 + turned / (2.0 * math.pi * f))
        decays[at] = 1.0 / (1.0 - kept * t60 / _NEPERS) - 1.0
    return cents, decays
