"""Permission to push: the one small table of panic, fault, arm, lease and restart. Pure; any thread.

The tick's compiled orders (`servo.force.orders`), the gateway's settings, docs/permission.md, tests and the model
that is searched exhaustively (tests/model) come from it. What is not in it changes nothing about the permission.
"""

from typing import NamedTuple

FREE, PANICKED, FAULTED = 0, 1, 2
STATES = ("free", "panicked", "faulted")
MAY_PUSH = (True, False, False)
REFUSED = -1


class PermissionEvent(NamedTuple):
    """One row: what happens, who may cause it, and the state after it for each state before it.

    `beside_lease`: whether it passes while somebody else than its sender holds the lease. REFUSED: it does not happen.
    """

    name: str
    cause: str
    then: tuple[int, int, int]
    beside_lease: bool = True

    @property
    def while_held(self) -> bool:
        """True when it can happen while a panic or a fault is latched."""
        return REFUSED not in self.then


PANIC, FAULT, ARM, SERVO, GATEWAY, SCENE, SET, LEASE = range(8)
EVENTS = (
    PermissionEvent("panic", "whoever may speak to the rig: page, OSC, Zenoh", (PANICKED, PANICKED, FAULTED)),
    PermissionEvent(
        "fault",
        "the tick itself: guard, device, values that are not numbers (NaN)",
        (FAULTED, FAULTED, FAULTED),
    ),
    PermissionEvent("arm", "a person at the haptic machine: `drumstick arm`", (FREE, FREE, FREE)),
    PermissionEvent("servo restarts", "its supervisor, after whatever ended it", (FREE, PANICKED, FAULTED)),
    PermissionEvent("gateway restarts", "its supervisor, after whatever ended it", (FREE, PANICKED, FAULTED)),
    PermissionEvent(
        "another scene",
        "the technician's page (role `panel`), OSC, MIDI, and programs on the haptic machine by Zenoh",
        (FREE, REFUSED, REFUSED),
        beside_lease=False,
    ),
    PermissionEvent(
        "set", "whoever may set: page, OSC, Zenoh", (FREE, PANICKED, FAULTED), beside_lease=False
    ),
    PermissionEvent(
        "lease", "whoever may set: taken, renewed, given back", (FREE, PANICKED, FAULTED), beside_lease=False
    ),
)


def after(state: int, event: int) -> int:
    """The state after `event`; the same one where it is refused."""
    then = EVENTS[event].then[state]
    return state if then == REFUSED else then
