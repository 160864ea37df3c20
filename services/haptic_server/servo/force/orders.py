"""The tick's response to orders from outside: the table of `permission`, compiled, for every plant.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from haptic_server import permission
from haptic_server.block_header import ARM, PANIC
from haptic_server.permission import FAULTED, FREE, PANICKED
from haptic_server.records import NO_FAULT, TickState
from haptic_server.servo.force.memory import Servo
from realtime.atomics import exchange, load_acquire
from realtime.kernels.jit import njit

NOTHING = -1
_EVENTS = len(permission.EVENTS)
_AFTER = tuple(permission.after(s, e) for s in range(len(permission.STATES)) for e in range(_EVENTS))
_PANIC, _ARM = permission.PANIC, permission.ARM


@njit()
def state_of(tick_state: TickState) -> int:
    """FREE, PANICKED or FAULTED. A fault says more than a panic that came with it."""
    if tick_state.fault != NO_FAULT:
        return FAULTED
    return PANICKED if tick_state.panicked != 0 else FREE


@njit()
def held_code(tick_state: TickState) -> int:
    """Code of the permission in the block, from which the next servo goes on: 0, 1 for a panic, 1 + fault."""
    if tick_state.fault != NO_FAULT:
        return 1 + tick_state.fault
    return 1 if tick_state.panicked != 0 else 0


@njit()
def obey(servo: Servo) -> int:
    """Obey a panic or an `arm` command that waits in the block; returns permission.PANIC, permission.ARM or NOTHING.

    A panic is a count, so one that comes after an `arm` command is never lost. Both in one tick: panic wins, and
    `drumstick arm` is needed again.
    """
    control, tick_state = servo.block.control, servo.tick_state[0]
    event = NOTHING
    panics = load_acquire(control, PANIC)
    armed = exchange(control, ARM, 0)
    if panics != tick_state.panics_seen:
        tick_state.panics_seen = panics
        event = _PANIC
    elif armed != 0:
        event = _ARM
    if event != NOTHING:
        state = _AFTER[state_of(tick_state) * _EVENTS + event]
        tick_state.panicked = 1 if state == PANICKED else 0
        if state != FAULTED:
            tick_state.fault = NO_FAULT
            servo.status[0].fault = NO_FAULT  # the next one is news, on this very tick too
    return event


@njit()
def forget_arm(servo: Servo) -> None:
    """Clear an arm given before a fault was published, which cannot have been meant for it. Before each status."""
    if servo.tick_state[0].fault != NO_FAULT and servo.status[0].fault == NO_FAULT:
        exchange(servo.block.control, ARM, 0)
