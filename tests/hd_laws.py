"""Laws for the stand-in arm, each with one habit of its own, and a servo to run them."""

import math

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.block_header import ARM, HELD
from haptic_server.records import NO_FAULT, Reading
from haptic_server.servo.force import memory
from haptic_server.servo.force.memory import Servo
from realtime.atomics import exchange, store_release
from realtime.kernels.jit import njit

WALL_N_PER_M = 400.0
STEADY_N = 3.0


def servo_at(rate_hz: int = 1000) -> Servo:
    """A servo of the scene `phantom`, without a simulated arm."""
    scene = parse(shipped_text("phantom") + f"\n[servo]\nrate_Hz = {rate_hz}\n", "phantom")
    return memory.prepare(scene, blocks.in_memory(law_of(scene)))


@njit()
def _latch(servo: Servo, reading: Reading) -> bool:
    # As the real law does: a fault holds until somebody arms it.
    tick_state = servo.tick_state[0]
    if exchange(servo.block.control, ARM, 0) != 0:
        tick_state.fault = NO_FAULT
    if tick_state.fault == NO_FAULT:
        tick_state.fault = reading.trouble
    store_release(servo.block.control, HELD, 1 if tick_state.fault != NO_FAULT else 0)
    return tick_state.fault == NO_FAULT


@njit()
def wall(servo: Servo, reading: Reading, now_ns: int, span_s: float) -> float:
    """A spring below z = 0."""
    if _latch(servo, reading) and reading.z_m < 0.0:
        return -WALL_N_PER_M * reading.z_m
    return 0.0


@njit()
def stubborn(servo: Servo, reading: Reading, now_ns: int, span_s: float) -> float:
    """Notices every fault, and pushes all the same."""
    _latch(servo, reading)
    return STEADY_N


@njit()
def deaf(servo: Servo, reading: Reading, now_ns: int, span_s: float) -> float:
    """Notices nothing and pushes."""
    return STEADY_N


@njit()
def greedy(servo: Servo, reading: Reading, now_ns: int, span_s: float) -> float:
    """Asks for more than any motor has."""
    return -1e3 if reading.z_m > 0.0 else 1e3


@njit()
def senseless(servo: Servo, reading: Reading, now_ns: int, span_s: float) -> float:
    """Answers with what is no number."""
    return math.nan if reading.z_m > 0.0 else math.inf
