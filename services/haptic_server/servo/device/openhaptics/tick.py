"""One frame of the HD layer around each tick of the law. Compiled; called by the driver's own thread.

Tick thread: no allocation, no locks, no Python, no exceptions. What the foreign calls do inside is the driver's affair.
"""

import math

from haptic_server.block_header import HELD, STOP, Cells
from haptic_server.records import NO_FAULT, NOT_A_NUMBER, SAFETY_SWITCH, Reading
from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.device.openhaptics.driver.faults import fault_of, is_hard, worse
from haptic_server.servo.device.openhaptics.frame import to_device, to_paper
from haptic_server.servo.device.openhaptics.freshness import is_new
from haptic_server.servo.device.openhaptics.port import (
    BEGIN_FRAME,
    END_FRAME,
    ENDED,
    ERROR,
    ERRORS,
    FAULT,
    GET_BOOLEAN,
    GET_DOUBLE,
    GET_ERROR,
    GET_INTEGER,
    INTERNAL,
    RATE_HZ,
    SET_DOUBLE,
    SPAN_WORST_NS,
    THREAD,
    TICKS,
    ZEROED,
    Port,
)
from haptic_server.servo.device.openhaptics.thread import own_id
from realtime.atomics import load_acquire, store_release
from realtime.clock import now_ns
from realtime.kernels.foreign import call_u32, call_u32_pointer, three_words
from realtime.kernels.jit import njit

_SELDOM = 100  # temperature and rate: every so many ticks
_MAX_ERRORS = 32  # in one go; the rest waits for the next, so that a flood cannot stop the tick


@njit()
def _drain(port: Port, fault: int) -> int:
    # Take the errors off the driver's stack; returns the worst fault, `fault` included.
    for _ in range(_MAX_ERRORS):
        code, internal, _device = three_words(port.calls[GET_ERROR])
        if code == names.SUCCESS:
            break
        store_release(port.cells, ERROR, code)
        store_release(port.cells, INTERNAL, internal)
        store_release(port.cells, ERRORS, port.cells[ERRORS] + 1)
        fault = worse(fault, fault_of(code))
    return fault


@njit()
def _read_seldom(port: Port) -> None:
    # How warm the warmest motor is, and the rate that the driver measures.
    motors, integers = port.motors, port.integers
    motors[:] = 0.0
    call_u32_pointer(port.calls[GET_DOUBLE], names.MOTOR_TEMPERATURE, motors.ctypes.data)
    warmest = 0.0
    for i in range(motors.shape[0]):
        warmest = max(warmest, motors[i])
    port.state[0].temperature = warmest
    integers[0] = 0
    call_u32_pointer(port.calls[GET_INTEGER], names.INSTANTANEOUS_UPDATE_RATE, integers.ctypes.data)
    store_release(port.cells, RATE_HZ, integers[0])


@njit()
def _safety(port: Port) -> int:
    # A switch that has never been closed may not be there at all; one that was, and opens, is a fault.
    state = port.state[0]
    if state.has_switch == 0:
        return NO_FAULT
    port.booleans[0] = 0
    call_u32_pointer(port.calls[GET_BOOLEAN], names.CURRENT_SAFETY_SWITCH, port.booleans.ctypes.data)
    if port.booleans[0] != 0:
        state.switch_was_closed = 1
        return NO_FAULT
    return SAFETY_SWITCH if state.switch_was_closed != 0 else NO_FAULT


@njit()
def _read(port: Port, reading: Reading, span_s: float) -> int:
    # Fill the reading, `span_s` after the last one; returns what is wrong. A getter that fails writes nothing: an old
    # position must not pass for standing still, nor an old button for one that is held.
    position = port.position_mm
    position[:] = math.nan
    call_u32_pointer(port.calls[GET_DOUBLE], names.CURRENT_POSITION, position.ctypes.data)
    port.integers[0] = 0
    call_u32_pointer(port.calls[GET_INTEGER], names.CURRENT_BUTTONS, port.integers.ctypes.data)
    reading.buttons = port.integers[0]
    fault = _safety(port)
    if port.cells[TICKS] % _SELDOM == 1:
        _read_seldom(port)
    reading.temperature = port.state[0].temperature
    if not (abs(position[0]) < 1e6 and abs(position[1]) < 1e6 and abs(position[2]) < 1e6):
        reading.fresh = 0
        return NOT_A_NUMBER
    to_paper(position, port.centre_mm, reading)
    reading.fresh = 1 if is_new(port.freshness[0], position, port.state[0].force_N, span_s) else 0
    return fault


@njit()
def begin(port: Port, reading: Reading) -> float:
    """Open the tick's frame and fill the reading, its `trouble` included; returns the seconds since the last tick."""
    return begin_at(port, reading, now_ns(port.timespec))


@njit()
def begin_at(port: Port, reading: Reading, now: int) -> float:
    """Like `begin`, at a given time, ns: a test's own clock."""
    state = port.state[0]
    span_ns = state.period_ns if state.last_ns == 0 else now - state.last_ns
    state.last_ns = now
    state.now_ns = now
    if port.cells[TICKS] == 0:
        store_release(port.cells, THREAD, own_id())
    store_release(port.cells, TICKS, port.cells[TICKS] + 1)
    store_release(port.cells, SPAN_WORST_NS, max(port.cells[SPAN_WORST_NS], span_ns))
    call_u32(port.calls[BEGIN_FRAME], state.device)
    seen = _read(port, reading, span_ns * 1e-9)
    drained = _drain(port, state.pending)
    reading.t_ns = now
    reading.trouble = worse(drained, seen)
    state.pending = NO_FAULT
    if is_hard(reading.trouble):
        state.hard = reading.trouble
    store_release(port.cells, FAULT, reading.trouble)
    return span_ns * 1e-9


@njit()
def finish(port: Port, control: Cells, reading: Reading, wanted_N: float) -> int:
    """Give the motors the law's force, or none, and close the frame; returns CALLBACK_DONE or CALLBACK_CONTINUE.

    Whatever the law says: no force while anything is wrong with this reading, while the law is held by a panic or a
    fault, or once STOP is set.
    """
    state = port.state[0]
    stopping = load_acquire(control, STOP) != 0
    force = min(max(wanted_N, -state.max_force_N), state.max_force_N)
    held = stopping or reading.trouble != NO_FAULT or load_acquire(control, HELD) != 0
    if held or not abs(wanted_N) < math.inf:
        force = 0.0
        store_release(port.cells, ZEROED, port.cells[ZEROED] + 1)
    state.force_N = force
    to_device(force, port.force_N)
    call_u32_pointer(port.calls[SET_DOUBLE], names.CURRENT_FORCE, port.force_N.ctypes.data)
    call_u32(port.calls[END_FRAME], state.device)
    state.pending = _drain(port, NO_FAULT)
    store_release(port.cells, FAULT, worse(reading.trouble, state.pending))
    if stopping or state.hard != NO_FAULT:
        store_release(port.cells, ENDED, 1)
        return names.CALLBACK_DONE
    return names.CALLBACK_CONTINUE
