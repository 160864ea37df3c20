"""The figure of a sound: its spectrum from instant to instant."""

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from rig.figures.style import HEAT, sheet, styled

_WINDOW_S = 0.06
_RANGE_DB = 80.0


@styled
def spectrogram(sound: npt.NDArray[np.float32], rate_Hz: int, f01_Hz: float, title: str) -> Figure:
    """`sound`: shape (n, 2), drawn as the sum of both channels up to thirty times f01, 80 dB deep."""
    figure, axes = sheet(title, "time, s", "frequency, Hz")
    mono = sound.astype(float).mean(axis=1)
    window = max(256, round(_WINDOW_S * rate_Hz))
    if len(mono) < window:
        mono = np.concatenate([mono, np.zeros(window - len(mono))])
    # Half a bit of a 24-bit file: a logarithm of silence is none.
    mono = mono + 3e-8 * np.cos(np.arange(len(mono)))
    power, _, _, image = axes.specgram(
        mono, NFFT=window, Fs=rate_Hz, noverlap=window * 7 // 8, pad_to=4 * window, cmap=HEAT
    )
    top = 10.0 * np.log10(float(np.max(power)))
    image.set_clim(top - _RANGE_DB, top)
    axes.set_ylim(0.0, min(30.0 * f01_Hz, rate_Hz / 2.0))
    bar = figure.colorbar(image, ax=axes, pad=0.01)
    bar.set_label("level, dB")
    bar.set_ticks([top - d for d in (80, 60, 40, 20, 0)], labels=["-80", "-60", "-40", "-20", "0"])
    return figure
