"""The loop around the tick: paced by the monotonic clock, or in virtual time.

Servo thread (SCHED_FIFO where permitted), without the GIL for its whole life. An overrun is counted and skipped, never
made up by a burst: the stick's exact solution simply covers the longer span.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.law import thrown
from drumstick.scene import Scene
from haptic_server.block import LATENESS_BIN_NS, LATENESS_BINS, STOP, Block
from haptic_server.records import EVENT, PLAN, PLAYER, STATUS
from haptic_server.servo.tick import tell, tick
from realtime.atomics import load_acquire
from realtime.clock import now_ns, sleep_until
from realtime.jit import njit

_LONGEST_SPAN_TICKS = 20  # after a longer stall the stick has simply stood still
_WARM_TICKS = 100  # lateness before this is the machine getting started, not the loop


class Servo(NamedTuple):
    """All the memory a servo thread touches. Arrays of one record each; made before the loop, never in it."""

    block: Block
    law: npt.NDArray[np.void]
    motion: npt.NDArray[np.void]
    player: npt.NDArray[np.void]
    plan: npt.NDArray[np.void]
    event: npt.NDArray[np.void]
    status: npt.NDArray[np.void]
    timespec: npt.NDArray[np.int64]


def prepare(scene: Scene, block: Block, held: bool = False) -> Servo:
    """Memory for one servo of this scene, with the parameters that its new block starts from.

    `held`: it starts in panic, because the servo before it was held by a panic or a fault.
    """
    plan = np.zeros(1, PLAN)
    plan["period_ns"] = round(1e9 / scene.servo.rate_Hz)
    plan["throw_m_per_s"] = scene.hand.throw_m_per_s
    plan["rest_s"] = scene.hand.rest_s
    plan["orbit_radius"] = scene.hand.orbit_radius
    plan["orbit_period_s"] = scene.hand.orbit_period_s
    plan["full_scale_m_per_s"] = scene.strike.full_scale_m_per_s
    plan["max_force_N"] = scene.guard.max_force_N
    plan["max_speed_m_per_s"] = scene.guard.max_speed_m_per_s
    player = np.zeros(1, PLAYER)
    player["revision"] = block.live["revision"][0]
    player["panicked"] = held
    return Servo(
        block=block,
        law=block.live["law"][:1].copy(),
        motion=thrown(scene, scene.hand.throw_m_per_s),
        player=player,
        plan=plan,
        event=np.zeros(1, EVENT),
        status=np.zeros(1, STATUS),
        timespec=np.zeros(2, np.int64),
    )


@njit()
def run_virtual(servo: Servo, ticks: int, start_ns: int) -> int:
    """`ticks` ticks without waiting; the clock is start_ns + k T. Returns the last tick's time."""
    plan = servo.plan[0]
    period = plan.period_ns
    now = start_ns
    for _ in range(ticks):
        now += period
        tick(
            servo.block, servo.law, servo.motion[0], servo.player[0], plan, servo.event[0], now, period * 1e-9
        )
        servo.status[0].tick += 1
        tell(servo.block, servo.law[0], servo.motion[0], servo.player[0], servo.status[0], now)
    return now


@njit()
def run_paced(servo: Servo) -> int:
    """Tick in real time until the block's STOP cell is set. Returns the number of ticks."""
    block = servo.block
    plan = servo.plan[0]
    status = servo.status[0]
    period = plan.period_ns
    deadline = now_ns(servo.timespec) + period
    span_ticks = 1
    while load_acquire(block.control, STOP) == 0:
        sleep_until(servo.timespec, deadline)
        lateness = now_ns(servo.timespec) - deadline
        if lateness < 0:
            continue  # a signal ended the sleep
        tick(
            block,
            servo.law,
            servo.motion[0],
            servo.player[0],
            plan,
            servo.event[0],
            deadline,
            span_ticks * period * 1e-9,
        )
        status.tick += 1
        if status.tick > _WARM_TICKS:
            block.lateness[min(lateness // LATENESS_BIN_NS, LATENESS_BINS - 1)] += 1
            status.lateness_worst_ns = max(status.lateness_worst_ns, lateness)
        missed = max(now_ns(servo.timespec) - deadline, 0) // period
        status.overruns += missed
        tell(block, servo.law[0], servo.motion[0], servo.player[0], status, deadline)
        deadline += (missed + 1) * period
        span_ticks = min(missed + 1, _LONGEST_SPAN_TICKS)
    return status.tick
