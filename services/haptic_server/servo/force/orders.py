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
def state_of(player: TickState) -> int:
    """FREE, PANICKED or FAULTED. A fault says more than a panic that came with it."""
    if player.fault != NO_FAULT:
        return FAULTED
    return PANICKED if player.panicked != 0 else FREE


@njit()
def held_word(player: TickState) -> int:
    """Word of the permission in the block, from which the next servo goes on: 0, 1 for a panic, 1 + fault."""
    if player.fault != NO_FAULT:
        return 1 + player.fault
    return 1 if player.panicked != 0 else 0


@njit()
def obey(servo: Servo) -> int:
    """Obey a panic or an `arm` command that waits in the block; returns permission.PANIC, permission.ARM or NOTHING.

    A panic is a count, so one that comes after an `arm` command is never lost. Both in one tick: panic wins, and
    `drumstick arm` is needed again.
    """
    control, player = servo.block.control, servo.player[0]
    event = NOTHING
    panics = load_acquire(control, PANIC)
    armed = exchange(control, ARM, 0)
    if panics != player.panics_seen:
        player.panics_seen = panics
        event = _PANIC
    elif armed != 0:
        event = _ARM
    if event != NOTHING:
        state = _AFTER[state_of(player) * _EVENTS + event]
        player.panicked = 1 if state == PANICKED else 0
        if state != FAULTED:
            player.fault = NO_FAULT
            servo.status[0].fault = NO_FAULT  # the next one is news, on this very tick too
    return event


@njit()
def forget_arm(servo: Servo) -> None:
    """Clear an arm given before a fault was published, which cannot have been meant for it. Before each status."""
    if servo.player[0].fault != NO_FAULT and servo.status[0].fault == NO_FAULT:
        exchange(servo.block.control, ARM, 0)
