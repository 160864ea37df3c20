"""Position of a recording at a tick. Tick thread: no allocation, no locks, no Python, no exceptions."""

import math

from drumstick.scenes.recording import Recording
from haptic_server.records import Reading
from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of


class PlaybackState(Record):
    """State of a playback: how far it has come, s, and the row before that."""

    replayed_s: float
    row: int


REPLAY = dtype_of(PlaybackState)


@njit()
def measure(
    replay: PlaybackState, path: Recording, head_z_m: float, reading: Reading, now_ns: int, span_s: float
) -> None:
    """Read the recording `span_s` later, interpolated linearly between its rows."""
    last = path.shape[0] - 1
    t = replay.replayed_s + span_s
    if t >= path[last, 0]:
        t -= path[last, 0] * math.floor(t / path[last, 0])
        replay.row = 0
    replay.replayed_s = t
    row = replay.row
    while row < last - 1 and path[row + 1, 0] <= t:
        row += 1
    replay.row = row
    share = (t - path[row, 0]) / (path[row + 1, 0] - path[row, 0])
    reading.x_m = path[row, 1] + share * (path[row + 1, 1] - path[row, 1])
    reading.y_m = path[row, 2] + share * (path[row + 1, 2] - path[row, 2])
    reading.z_m = head_z_m + path[row, 3] + share * (path[row + 1, 3] - path[row, 3])
    reading.t_ns = now_ns
    reading.fresh = 1
