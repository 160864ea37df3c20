"""Speed from quantised positions: a first-order window that is as long as a straight line explains it.

End-fit first-order adaptive windowing (FOAW): Janabi-Sharifi, Hayward, Chen, "Discrete-time adaptive windowing for
velocity estimation", IEEE Trans. Control Systems Technology 8(6), 2000. A stick at rest gets a long window and little
noise, one that turns a short window and little lag. Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from typing import Annotated

import numpy as np
import numpy.typing as npt

from drumstick.safety.sampled_contact import MAX_WINDOW
from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of

LONGEST = MAX_WINDOW + 1  # positions kept


class Track(Record):
    """The last positions z and their instants t, as rings: `newest` is the index of the last, `known` their number.
    `widest`: ticks of the longest window, which a stiff or strongly damped head takes short
    (drumstick.safety.sampled_contact).
    """

    z_m: Annotated[npt.NDArray[np.float64], "f8", (LONGEST,)]
    t_s: Annotated[npt.NDArray[np.float64], "f8", (LONGEST,)]
    newest: int
    known: int
    widest: int
    v_m_per_s: float


TRACK = dtype_of(Track)


def new_track(widest: int = LONGEST - 1) -> npt.NDArray[np.void]:
    """The memory of one estimate, shape (1,), with windows of at most `widest` ticks. Control thread."""
    track = np.zeros(1, TRACK)
    track["widest"] = widest
    return track


@njit()
def forget(track: Track) -> None:
    """Start afresh: after a stall the old positions say nothing about the speed now."""
    track.known = 0
    track.v_m_per_s = 0.0


@njit()
def _explained(track: Track, back: int, slope: float, slack_m: float) -> bool:
    # Do all positions between the newest and `back` lie within slack_m of the line through these two?
    newest = track.newest
    z, t = track.z_m[newest], track.t_s[newest]
    for between in range(1, back):
        at = (newest - between) % LONGEST
        off = track.z_m[at] - (z - slope * (t - track.t_s[at]))
        if not -slack_m <= off <= slack_m:
            return False
    return True


@njit()
def follow(track: Track, t_s: float, z_m: float, slack_m: float) -> float:
    """Add a position; returns the speed in m/s. `slack_m`: what noise and quantisation may add, m; t_s must rise."""
    newest = (track.newest + 1) % LONGEST
    track.newest = newest
    track.z_m[newest] = z_m
    track.t_s[newest] = t_s
    track.known = min(track.known + 1, LONGEST)
    speed = 0.0
    for back in range(1, min(track.known, track.widest + 1)):
        at = (newest - back) % LONGEST
        slope = (z_m - track.z_m[at]) / (t_s - track.t_s[at])
        if back > 1 and not _explained(track, back, slope, slack_m):
            break
        speed = slope
    track.v_m_per_s = speed
    return speed
