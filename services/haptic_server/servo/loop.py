"""The loop around the tick: paced by the monotonic clock, or in virtual time.

Servo thread (SCHED_FIFO where permitted), without the GIL for its whole life. An overrun is counted and skipped, never
made up by a burst: the stick's exact solution simply covers the longer span, and the guard of a sampled arm sees it.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from haptic_server.block import LATENESS_BIN_NS, LATENESS_BINS
from haptic_server.block_header import STOP
from haptic_server.servo.force.event_output import publish_status
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.pointed import pointed_arm_tick, pointed_stick_tick
from haptic_server.servo.force.sampled import own_device_tick, replayed_tick, sampled_tick
from haptic_server.servo.force.tick import tick
from haptic_server.servo.trace import note
from realtime.atomics import load_acquire
from realtime.clock import now_ns, wait_until
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import ArgumentType, is_none, njit, overload

WARM_TICKS = 100  # lateness before this is the machine getting started, not the loop
FOR_EVER = 2**62  # ticks

Times = npt.NDArray[np.int64]


def _is_sampled(servo: Servo) -> bool:
    raise TypeError("compiled code only")


@overload(_is_sampled)
def _is_sampled_by_type(servo: ArgumentType) -> Callable[[Servo], bool]:
    sampled = not all(is_none(servo, part) for part in ("plant", "replay", "own"))
    return lambda servo: sampled


def _tick(servo: Servo, now_ns: int, span_s: float) -> None:
    raise TypeError("compiled code only")


@overload(_tick)
def _tick_of_plant(
    servo: ArgumentType, now_ns: ArgumentType, span_s: ArgumentType
) -> Callable[[Servo, int, float], None]:
    # Decided at compile time: the exact stick gets none of a sampled arm's code, nor the other way round.
    is_pointed = not is_none(servo, "pointed")
    if not is_none(servo, "replay"):
        return lambda servo, now_ns, span_s: replayed_tick(servo, now_ns, span_s)
    if not is_none(servo, "own"):
        return lambda servo, now_ns, span_s: own_device_tick(servo, now_ns, span_s)
    if is_none(servo, "plant"):
        if is_pointed:
            return lambda servo, now_ns, span_s: pointed_stick_tick(servo, now_ns, span_s)
        return lambda servo, now_ns, span_s: tick(servo, now_ns, span_s)
    if is_pointed:
        return lambda servo, now_ns, span_s: pointed_arm_tick(servo, now_ns, span_s)
    return lambda servo, now_ns, span_s: sampled_tick(servo, now_ns, span_s)


@njit()
def traced_tick(servo: Servo, now_ns: int, span_s: float) -> None:
    """One tick of whatever the servo drives, and its line in the trace."""
    _tick(servo, now_ns, span_s)
    head_z_m = servo.plan[0].head_z_m
    note(servo.trace, servo.motion[0], servo.tick_state[0], servo.reading[0], head_z_m, now_ns, span_s)


@njit()
def run_virtual(servo: Servo, ticks: int, start_ns: int) -> int:
    """`ticks` ticks without waiting; the clock is start_ns + k T. Returns the last tick's time."""
    servo = borrowed_view(servo)
    period = servo.plan[0].period_ns
    now = start_ns
    for _ in range(ticks):
        now += period
        traced_tick(servo, now, period * 1e-9)
        servo.status[0].tick += 1
        publish_status(servo, now)
    return now


class Log(NamedTuple):
    """Times of each tick for a self-test, ns: when it was due, how late it came, how long it took. Shapes (n,)."""

    due_ns: npt.NDArray[np.int64]
    late_ns: npt.NDArray[np.int64]
    spent_ns: npt.NDArray[np.int64]


NO_LOG = Log(*(np.zeros(0, np.int64) for _ in range(3)))


@njit()
def _keep(log: Log, tick: int, deadline: int, woken: int, timespec: Times) -> None:
    if tick < log.due_ns.shape[0]:
        log.due_ns[tick] = deadline
        log.late_ns[tick] = woken - deadline
        log.spent_ns[tick] = now_ns(timespec) - woken


@njit()
def run_paced(servo: Servo, log: Log, first_ns: int, most_ticks: int) -> int:
    """Tick in real time, `most_ticks` times or until the block's STOP cell is set; no force acts after that.

    `first_ns`: when the first is due. Returns the ticks; `log` keeps as many as it has room for. The exact stick moves
    from deadline to deadline, so its roll is as even as the clock; a sampled arm is where it is when the tick really
    comes.
    """
    servo = borrowed_view(servo)
    block = servo.block
    status = servo.status[0]
    period = servo.plan[0].period_ns
    spin = servo.plan[0].spin_ns
    deadline = first_ns
    last = deadline - period
    span = period
    ticks = 0
    while load_acquire(block.control, STOP) == 0 and ticks < most_ticks:
        wait_until(servo.timespec, deadline, spin)
        woken = now_ns(servo.timespec)
        lateness = woken - deadline
        if lateness < 0:
            continue  # a signal ended the sleep
        if _is_sampled(servo):
            traced_tick(servo, woken, (woken - last) * 1e-9)
        else:
            traced_tick(servo, deadline, span * 1e-9)
        last = woken
        status.tick += 1
        if status.tick > WARM_TICKS:
            block.lateness[min(lateness // LATENESS_BIN_NS, LATENESS_BINS - 1)] += 1
            status.lateness_worst_ns = max(status.lateness_worst_ns, lateness)
        missed = max(now_ns(servo.timespec) - deadline, 0) // period
        status.overruns += missed
        publish_status(servo, deadline)
        _keep(log, ticks, deadline, woken, servo.timespec)
        ticks += 1
        span = (missed + 1) * period
        deadline += span
    servo.tick_state[0].force_N = 0.0
    publish_status(servo, last)
    return ticks


def warm_up(spare: Servo) -> None:
    """Compile the loop for servos of this type and touch every path, before real time. Control thread; seconds."""
    for _ in range(200):
        run_paced(spare, NO_LOG, time.monotonic_ns(), 1)
