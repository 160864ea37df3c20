"""First samples of strikes in a recording, their times by the monotonic clock, and the strikes that they belong to."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from drumstick_lab.benchmarks.latency.jack_listener import Integers, Recorded, Samples

ABOVE = 0.01  # of a strike's usual peak: it begins to sound when it is 40 dB below that
QUIET_S = 0.01  # so long below it: the drum has come to rest
_STRIKE_S = 0.05  # about one strike falls into each window of this length
_RISE_S = 0.001  # a strike's own begin, below the threshold yet
_CYCLES = 64  # among so many one callback comes promptly

Times = npt.NDArray[np.int64]


class FirstSamples(NamedTuple):
    """Numbers of the samples; and the loudest of what the drum still sounded before any of them, of the threshold."""

    at: Integers
    rest: float


def first_samples(samples: Samples, rate_Hz: float, above: float = ABOVE) -> FirstSamples:
    """Samples that are the first above `above` of a strike's usual peak after QUIET_S below that. The recording's begin
    is none."""
    loud = np.abs(samples)
    threshold = above * _usual_peak(loud, round(_STRIKE_S * rate_Hz))
    quiet = round(QUIET_S * rate_Hz)
    over = np.flatnonzero(loud > threshold)
    before = np.concatenate(([-1], over[:-1]))
    at = over[over - before > quiet]
    at = at[at >= quiet]
    rise = round(_RISE_S * rate_Hz)
    rest = max((float(loud[each - quiet : each - rise].max()) for each in at), default=0.0)
    return FirstSamples(at, rest / threshold if threshold else 0.0)


def _usual_peak(loud: Samples, window: int) -> float:
    # Of the loudest sample a gap in the sound may be to blame.
    whole = loud[: len(loud) // window * window]
    return float(np.median(whole.reshape(-1, window).max(axis=1))) if len(whole) else 0.0


class Cycles(NamedTuple):
    """Moments at which the device began each cycle, monotonic ns; and how long after that its callback ran, ns."""

    begun_ns: Times
    held_up_ns: Times


def cycles_of(recorded: Recorded) -> Cycles:
    """JACK's frames on the monotonic clock. A device counts its frames evenly and a callback never comes too early, so
    the promptest callbacks around tell when each cycle began; on both sides, because the device's count jumps where it
    stood still. (JACK's own estimate, jack_get_cycle_times, takes seconds to recover from such a jump.)"""
    even_ns = _frame_ns(np.unwrap(recorded.cycles[:, 1], period=1 << 32), recorded.rate_Hz)
    late_ns = recorded.cycles[:, 2] - even_ns
    numbers = np.arange(len(late_ns))
    window = min(_CYCLES, len(late_ns))
    promptest = sliding_window_view(late_ns, window).min(axis=1)
    after = promptest[np.minimum(numbers, len(promptest) - 1)]
    before = promptest[np.maximum(numbers - window + 1, 0)]
    least_ns = np.maximum(before, after)
    return Cycles(even_ns + least_ns, late_ns - least_ns)


def _frame_ns(frames: Integers, rate_Hz: float) -> Times:
    return np.round(frames * (1e9 / rate_Hz)).astype(np.int64)


def times_ns(recorded: Recorded, at: Integers) -> Times:
    """Times of these samples by the monotonic clock: of the begin of their cycle, and their place in it."""
    firsts = recorded.cycles[:, 0]
    of = np.searchsorted(firsts, at, side="right") - 1
    return cycles_of(recorded).begun_ns[of] + _frame_ns(at - firsts[of], recorded.rate_Hz)


def delays_ns(struck_ns: Times, heard_ns: Times, least_ns: int = 0) -> tuple[Times, int]:
    """From each strike to the first sound at least so much later that belongs to no strike after it; and how many were
    not heard. Both in order."""
    at = np.searchsorted(heard_ns, struck_ns + least_ns)
    ends = np.append(at[1:], len(heard_ns))
    is_heard = at < ends
    return heard_ns[at[is_heard]] - struck_ns[is_heard], int(np.count_nonzero(~is_heard))
