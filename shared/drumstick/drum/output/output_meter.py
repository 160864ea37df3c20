"""Meter of what leaves by the sink: all drums together, behind the limiter. Audio thread; no allocation, no locks."""

import math

import numpy as np
import numpy.typing as npt

from drumstick.drum.output.limiter import KNEE, limited
from realtime.kernels.jit import njit
from realtime.records import Record, Rows, dtype_of

PEAK_FALL_S = 0.3  # a shown peak falls to 1/e in this time
# A steady tone's level is shown to 99 % after 0.3 s, as by a VU meter (IEC 60268-17), though of the true rms. The mean
# square has then come to 0.99^2 of its end.
RMS_TIME_CONSTANT_S = -0.3 / math.log(1.0 - 0.99**2)


class OutputMeter(Record):
    """Written by the audio thread, read by any, since the sink was opened. Linear, 1 is full scale. peak: largest
    sample of any channel, falling back by itself; rms: level of the loudest channel (1 / sqrt 2 for a sine of full
    scale); limited_frames: frames that the limiter bent; clipped_frames: those of them that left at full scale."""

    peak: float
    rms: float
    limited_frames: int
    clipped_frames: int


OUTPUT_METER = dtype_of(OutputMeter)


@njit()
def limit_and_measure(
    sound: npt.NDArray[np.float32],
    rows: Rows[OutputMeter],
    mean_squares: npt.NDArray[np.float64],
    rate_Hz: float,
) -> None:
    """Limit every sample of `sound`, shape (n, channels), where it stands, and bring the meter up to date.

    `mean_squares`, shape (channels or more,), is the meter's memory.
    """
    meter: OutputMeter = rows[0]
    channels = sound.shape[1]
    share = -math.expm1(-1.0 / (RMS_TIME_CONSTANT_S * rate_Hz))
    peak = 0.0
    for i in range(sound.shape[0]):
        before = after = 0.0
        for channel in range(channels):
            sample = float(sound[i, channel])
            left = np.float32(limited(sample))
            sound[i, channel] = left
            before = max(before, abs(sample))
            after = max(after, abs(float(left)))
            mean_squares[channel] += share * (float(left) * float(left) - mean_squares[channel])
        peak = max(peak, after)
        if before > KNEE:
            meter.limited_frames += 1
            if after >= 1.0:  # the bend rounds to it from 2.8 times full scale on
                meter.clipped_frames += 1
    meter.peak = max(peak, math.exp(-sound.shape[0] / (PEAK_FALL_S * rate_Hz)) * meter.peak)
    loudest = 0.0
    for channel in range(channels):
        if not mean_squares[channel] < math.inf:  # a drum gave a sample that is no number
            mean_squares[channel] = 0.0
        loudest = max(loudest, mean_squares[channel])
    meter.rms = math.sqrt(loudest)
