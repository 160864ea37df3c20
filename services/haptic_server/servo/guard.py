"""The guard of a device that a hand holds: what it refuses to render, and how it gives up. Always on.

Every tick it looks at the reading first and at the force last. What is wrong for good is a latched fault: zero force on
the same tick, until `drumstick arm` on this machine. It is a second line behind the envelope: the envelope bounds what
parameters may ask, the guard what may reach the motors whatever they ask. Tick thread: no allocation, no locks, no
Python, no exceptions.
"""

import math
from typing import Any

import numpy as np

from drumstick import bounds
from haptic_server.records import (
    DEAD_MAN,
    NO_FAULT,
    NOT_A_NUMBER,
    OUTSIDE,
    STALE,
    STALLED,
    TOO_FAST,
)
from realtime.jit import Record, njit

STALL_PAUSE_S = 0.005  # a longer gap between ticks: no force until the stick was above the head again
STALL_FAULT_S = 0.020  # a longer one is a latched fault
STALE_S = 0.010  # a device that has told nothing new for so long
_SEEN_ABOVE_M = 1e-3  # so far above the head the stick must have been before anything is rendered
_SLACK = 0.01  # of a blow's energy: what quantised positions may pretend
MEMORY = 9  # ticks of the head's force: the longest delay of a device, and the present

# What it remembers. `gain` ramps from 0 to 1; `given_J` is what the head has given the stick in this contact,
# `budget_J` what it may give; `head_N` is a ring of the head's share in the forces that went out, `z_m` the last tick's
# position.
GUARD: np.dtype[Any] = np.dtype(
    [
        ("seen_above", "i8"),
        ("gain", "f8"),
        ("force_N", "f8"),
        ("head_N", "f8", (MEMORY,)),
        ("newest", "i8"),
        ("z_m", "f8"),
        ("given_J", "f8"),
        ("budget_J", "f8"),
        ("fresh_ns", "i8"),
        ("limited", "i8"),
        ("held_back", "i8"),
        ("stalls", "i8"),
        ("e", "f8"),
        ("b", "f8"),
    ],
    align=True,
)

# What a device and the scene allow, in the paper's frame. It does not change while a servo runs.
ALLOWED: np.dtype[Any] = np.dtype(
    [
        ("max_force_N", "f8"),
        ("max_slew_N_per_s", "f8"),
        ("max_speed_m_per_s", "f8"),
        ("lowest_m", "f8"),
        ("highest_m", "f8"),
        ("ramp_s", "f8"),
        ("dead_man", "i8"),
        ("resolution_m", "f8"),
        ("delay_ticks", "i8"),
        ("m_kg", "f8"),
    ],
    align=True,
)


@njit()
def let_go(guard: Record) -> None:
    """No force from here on until the stick has been above the head, and then by a ramp."""
    guard.seen_above = 0
    guard.gain = 0.0
    guard.force_N = 0.0
    for tick in range(MEMORY):
        guard.head_N[tick] = 0.0
    guard.given_J = 0.0
    guard.budget_J = 0.0


@njit()
def look(guard: Record, allowed: Record, reading: Record, now_ns: int, span_s: float) -> int:
    """Is this reading fit to render from? NO_FAULT, or the code of what is wrong for good. In accept form."""
    if reading.trouble != NO_FAULT:
        return int(reading.trouble)
    if not (abs(reading.x_m) < 1e3 and abs(reading.y_m) < 1e3 and abs(reading.z_m) < 1e3):
        return NOT_A_NUMBER
    if not 0.0 <= span_s <= STALL_FAULT_S:
        return STALLED
    if reading.fresh != 0 or guard.fresh_ns == 0:
        guard.fresh_ns = now_ns
    if not (now_ns - guard.fresh_ns) * 1e-9 <= STALE_S:
        return STALE
    if not allowed.lowest_m <= reading.z_m <= allowed.highest_m:
        return OUTSIDE
    if not span_s <= STALL_PAUSE_S:
        guard.stalls += 1
        let_go(guard)
    return NO_FAULT


@njit()
def look_at_speed(allowed: Record, v: float) -> int:
    """Is the stick slow enough? NO_FAULT or TOO_FAST."""
    return NO_FAULT if abs(v) <= allowed.max_speed_m_per_s else TOO_FAST


@njit()
def ready(guard: Record, allowed: Record, reading: Record, z: float, period_s: float) -> int:
    """May it push now? NO_FAULT, or DEAD_MAN while the button that must be held is not. Moves the ramp on."""
    if allowed.dead_man != 0 and reading.buttons == 0:
        let_go(guard)
        return DEAD_MAN
    if guard.seen_above == 0:
        if z > _SEEN_ABOVE_M:
            guard.seen_above = 1
        guard.gain = 0.0
        return NO_FAULT
    guard.gain = min(1.0, guard.gain + period_s / allowed.ramp_s)
    return NO_FAULT


@njit()
def may_add(law: Record) -> tuple[float, float]:
    """e and b of drumstick.bounds without the pulses: what the head may make of an entry speed."""
    return bounds.multiplied_by_head(law), bounds.added_by_head(law)


@njit()
def open_account(guard: Record, allowed: Record, m: float, v_in: float) -> None:
    """A contact begins at v_in: the head may give back what it took, and what its effects are meant to add.

    guard.e and guard.b as in drumstick.bounds: the contact may end at e |v_in| + b, without its pulses. A live m above
    what the arm has does not raise what the arm may be given.
    """
    speed = abs(v_in)
    leaving = guard.e * speed + guard.b
    added = max(leaving * leaving - speed * speed, 0.0)
    guard.given_J = 0.0
    guard.budget_J = 0.5 * min(m, allowed.m_kg) * (added + _SLACK * speed * speed)


@njit()
def _on_its_way(guard: Record, delay_ticks: int) -> float:
    # The forces that went out and have not acted yet, N.
    total = 0.0
    for back in range(delay_ticks):
        total += guard.head_N[(guard.newest - back) % MEMORY]
    return total


@njit()
def _observe(guard: Record, delay_ticks: int, z: float) -> None:
    # The head's force that acted over the last tick: of a tick ago, or earlier by the device's own delay.
    guard.given_J += guard.head_N[(guard.newest - delay_ticks) % MEMORY] * (z - guard.z_m)
    guard.z_m = z


@njit()
def _affordable(guard: Record, allowed: Record, v: float, period_s: float) -> float:
    # The most that the head may push with now, N. Passivity observer and controller in one: Hannaford and Ryu,
    # "Time-domain passivity control of haptic interfaces", IEEE Trans. Robotics and Automation 18(1), 2002. Theirs adds
    # damping; this holds the head back, which cannot overshoot.
    #
    # F may give no more than is left: F (v + c F) T <= left, where c F is what the stick gains in the tick to come, and
    # half as much again because the estimate of v is late. A stick that sinks or stands still may always be pushed: one
    # tick later, at most F_max^2 T^2/(2 m) too much, it is seen to move. Else a long press would sink through the head.
    if v <= 0.0:
        return math.inf
    c = 1.5 * period_s / allowed.m_kg
    left = max(guard.budget_J - guard.given_J, 0.0)
    most = (math.sqrt(v * v + 4.0 * c * left / period_s) - v) / (2.0 * c)
    return max(most - _on_its_way(guard, allowed.delay_ticks), 0.0)


@njit()
def limit(
    guard: Record, allowed: Record, head_N: float, pulse_N: float, z: float, v: float, period_s: float
) -> float:
    """The force that goes to the motors, N, out of what the head and the pulses ask for: both must be numbers.

    The account is of forces that really go out. While the ramp rises a head takes little of a blow and could give back
    all of it; a force that may only fall slowly would push on behind a stick that has left.
    """
    _observe(guard, allowed.delay_ticks, z)
    head_N *= guard.gain
    pulse_N *= guard.gain
    most = _affordable(guard, allowed, v, period_s)
    wanted = head_N + pulse_N
    force = min(max(wanted, -allowed.max_force_N), allowed.max_force_N)
    step = allowed.max_slew_N_per_s * period_s
    force = min(max(force, guard.force_N - step), guard.force_N + step)
    if not force - pulse_N <= most:
        guard.held_back += 1
        force = min(max(most + pulse_N, -allowed.max_force_N), allowed.max_force_N)
    if not abs(force) <= allowed.max_force_N:  # NaN: nothing finite came in
        force = 0.0
    if force != wanted:
        guard.limited += 1
    guard.newest = (guard.newest + 1) % MEMORY
    guard.head_N[guard.newest] = max(
        force - pulse_N, min(head_N, 0.0)
    )  # what a limit takes, it takes from the pulse
    guard.force_N = force
    return force


@njit()
def felt(guard: Record) -> float:
    """The head's share of the force that was let through last, N."""
    return guard.head_N[guard.newest]
