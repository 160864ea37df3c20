"""The memory between the servo callback and the thread that started it. Made before the first tick.

`state` belongs to the callback. `cells` are what the control thread looks at meanwhile, by acquire loads.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from haptic_server.servo.device.openhaptics.driver.hd import Hd
from haptic_server.servo.device.openhaptics.freshness import FRESHNESS
from realtime.records import Record, dtype_of

# Indices into `calls`: the addresses of the functions that a tick calls.
BEGIN_FRAME, END_FRAME, GET_BOOLEAN, GET_INTEGER, GET_DOUBLE, SET_DOUBLE, GET_ERROR = range(7)
_CALLED = (
    "hdBeginFrame",
    "hdEndFrame",
    "hdGetBooleanv",
    "hdGetIntegerv",
    "hdGetDoublev",
    "hdSetDoublev",
    "hdGetError",
)

# Indices into `cells`. TICKS counts calls; ENDED is 1 when the callback has asked not to be called again; FAULT is the
# worst that the driver has said since the last tick that the law saw; ERROR and INTERNAL are the last HD error, ERRORS
# how many there were; ZEROED counts ticks whose force was withheld; THREAD is the driver's thread; RATE_HZ what the
# driver measures.
TICKS, ENDED, FAULT, ERROR, INTERNAL, ERRORS, ZEROED, THREAD, RATE_HZ, SPAN_WORST_NS = range(10)
_CELLS = 16
_MAX_MOTORS = 16  # 3 or 6 are known; a driver that tells more must not write over something else


class PortState(Record):
    """State of the driver's callback between ticks: handle, clock, faults, and the motors' limits."""

    device: int
    period_ns: int
    last_ns: int
    now_ns: int
    pending: int  # a fault that the driver reported after the law had been asked
    hard: int  # a fault that only a new process gets over
    has_switch: int
    switch_was_closed: int
    temperature: float
    force_N: float
    max_force_N: float


STATE = dtype_of(PortState)


class Port(NamedTuple):
    """calls: addresses. position_mm, centre_mm, force_N: (3,), in the device's frame."""

    calls: npt.NDArray[np.int64]
    cells: npt.NDArray[np.int64]
    state: npt.NDArray[np.void]
    freshness: npt.NDArray[np.void]
    position_mm: npt.NDArray[np.float64]
    centre_mm: npt.NDArray[np.float64]
    force_N: npt.NDArray[np.float64]
    motors: npt.NDArray[np.float64]
    integers: npt.NDArray[np.int32]
    booleans: npt.NDArray[np.uint8]
    timespec: npt.NDArray[np.int64]


def blank(period_ns: int) -> Port:
    """A port that leads nowhere: made to be filled in, or to be compiled for. Control thread."""
    state = np.zeros(1, STATE)
    state["period_ns"] = period_ns
    return Port(
        calls=np.zeros(len(_CALLED), np.int64),
        cells=np.zeros(_CELLS, np.int64),
        state=state,
        freshness=np.zeros(1, FRESHNESS),
        position_mm=np.zeros(3),
        centre_mm=np.zeros(3),
        force_N=np.zeros(3),
        motors=np.zeros(_MAX_MOTORS),
        integers=np.zeros(_MAX_MOTORS, np.int32),
        booleans=np.zeros(_MAX_MOTORS, np.uint8),
        timespec=np.zeros(2, np.int64),
    )


def make(
    hd: Hd,
    device: int,
    period_ns: int,
    max_force_N: float,
    centre_mm: tuple[float, float, float],
    has_switch: bool,
) -> Port:
    """A port for one run. `has_switch`: the device answers when asked for its safety switch. Control thread."""
    port = blank(period_ns)
    port.calls[:] = [hd.address(name) for name in _CALLED]
    port.state["device"] = device
    port.state["max_force_N"] = max_force_N
    port.state["has_switch"] = has_switch
    port.centre_mm[:] = centre_mm
    return port
