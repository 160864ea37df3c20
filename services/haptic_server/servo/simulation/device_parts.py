"""Reading and writing of a device that another package gives, in the tick.

Tick thread: no allocation, no locks, no Python, no exceptions, as far as its author keeps to that.
"""

import math
from types import ModuleType

from haptic_server.records import Reading
from realtime.kernels.folding import each, folded
from realtime.kernels.jit import njit
from realtime.records import Record, Rows

# By name; the one that plays is found by the record's type. `haptic_server.servo.device.own_device` adds it.
DEVICES: dict[str, ModuleType] = {}


@folded(DEVICES, each)
def read(own: Record, reading: Reading, span_s: float) -> None:
    """Move by `span_s` if it is simulated, and fill the reading."""


@folded(DEVICES, each)
def write(own: Record, force_N: float) -> None:
    """Give this force to its motors, N along z, up to the next tick."""


@njit()
def measure(own: Record, reading: Reading, now_ns: int, span_s: float) -> None:
    """A reading at `now_ns`. What its package leaves out is no position, and not new."""
    reading.z_m = math.nan
    reading.fresh = 0
    reading.t_ns = now_ns
    read(own, reading, span_s)


@njit()
def release_force(own: Rows[Record]) -> None:
    """No force: at the end of a run."""
    write(own[0], 0.0)
