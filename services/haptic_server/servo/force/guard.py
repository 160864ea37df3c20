"""The guard of a device that a hand holds: limits of force, speed and energy, and the faults at which it gives up.
Always on.

Every tick it checks the reading first and limits the force last. A reading that cannot be rendered from is a latched
fault: zero force on the same tick, until `drumstick arm` on this machine. The guard is the second line behind the
envelope: the envelope bounds what parameters may ask for, the guard what reaches the motors whatever they ask. Energy
is limited by a passivity observer and controller (Hannaford and Ryu, "Time-domain passivity control of haptic
interfaces", IEEE Trans. Robotics and Automation 18(1), 2002). Tick thread: no allocation, no locks, no Python, no
exceptions.
"""

import math
from typing import Annotated

import numpy as np
import numpy.typing as npt

from drumstick.parameters.rig import MAX_DELAY_TICKS
from drumstick.safety import bounds
from drumstick.stick.records import Law
from haptic_server.records import (
    DEAD_MAN,
    NO_FAULT,
    NOT_A_NUMBER,
    SELF_DRIVEN,
    STALE,
    STALE_S,
    STALL_FAULT_S,
    STALLED,
    TOO_FAST,
    Reading,
)
from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of

STALL_PAUSE_S = 0.005  # a longer gap between ticks: no force until the stick was above the head again
_SEEN_ABOVE_M = 1e-3  # so far above the head the stick must have been before anything is rendered
_KEPT = 0.01  # of a blow's energy the head keeps at least, whatever its law says
_SLOW_M_PER_S = 0.01
_MOTION_COUNTS = 1.5  # a move of more counts of the encoder is one
_TURN_COUNTS = _MOTION_COUNTS + 1.0  # and each position is read to within a count
_SOFT_M = 0.01  # over so much before the lowest position the head's force fades to none
MEMORY = MAX_DELAY_TICKS + 1  # ticks of the head's force: the longest delay of a device, and the present

# A head that drives the stick by itself: the observer finds more energy going out than the contact may give. An excess
# below the energy at _EXCESS_M_PER_S is the encoders'. One above that at _FAULT_EXCESS_M_PER_S and above
# _FAULT_EXCESS_SHARE of the blow's is a fault, and so are more than _MAX_DRIVEN contacts in a row that begin with an
# excess. As many contacts in a row at the limit of force, faster than a hand strikes, without a pulse, and not much
# slower than the first of them are one too: then the observer itself is wrong, by a delay that nobody declared.
_EXCESS_M_PER_S = 0.05
_FAULT_EXCESS_M_PER_S = 0.5
_FAULT_EXCESS_SHARE = 0.5
_MAX_DRIVEN = 12
_FASTEST_HAND_NS = 80_000_000
_AT_THE_LIMIT = 0.99
_UNTIRED = 0.6


class GuardState(Record):
    """State of the guard from tick to tick.

    `gain` ramps from 0 to 1. Passivity observer: `given_J` is the energy that the head has given the stick since the
    contact began, plus the excess carried into it; `budget_J` is what it may give, `blow_J` the stick's kinetic energy
    at the entry; `head_N` is a ring of the head's share in the forces that went out, `z_m` the position a
    tick ago, `counted_m` the one up to which their work was counted, `least_N` and `most_N` the extremes of what acted
    since. `driven`, `saturated`: contacts in a row that began with an excess, or at the limit of force (the first of
    these at `first_m_per_s`). `turned`: whether the stick has come back up; `peak_N`, `pulsed`: the largest force, and
    whether a pulse pushed, since the last contact began at `entry_ns`.
    """

    seen_above: int
    gain: float
    force_N: float
    head_N: Annotated[npt.NDArray[np.float64], "f8", (MEMORY,)]
    newest: int
    z_m: float
    counted_m: float
    least_N: float
    most_N: float
    turned: int
    given_J: float
    budget_J: float
    fresh_ns: int
    limited: int
    passivity_limited_ticks: int
    stalls: int
    max_restitution: float
    max_added_speed: float
    blow_J: float
    driven: int
    saturated: int
    first_m_per_s: float
    peak_N: float
    pulsed: int
    entry_ns: int


GUARD = dtype_of(GuardState)


class DeviceLimits(Record):
    """Limits of the device and the scene, in the paper's frame. They do not change while a servo runs."""

    max_force_N: float
    max_slew_N_per_s: float
    max_speed_m_per_s: float
    lowest_m: float
    highest_m: float
    ramp_s: float
    dead_man: int
    resolution_m: float
    delay_ticks: int
    m_kg: float
    head_z_m: float


DEVICE_LIMITS = dtype_of(DeviceLimits)


@njit()
def _excess_energy(guard: GuardState) -> float:
    # Energy that the head gave beyond its budget, J. A negative budget (it keeps some of a blow) makes no excess.
    return max(guard.given_J - max(guard.budget_J, 0.0), 0.0)


@njit()
def release_force(guard: GuardState) -> None:
    """No force from here on until the stick has been above the head, and then by a ramp."""
    guard.seen_above = 0
    guard.gain = 0.0
    guard.force_N = 0.0
    for tick in range(MEMORY):
        guard.head_N[tick] = 0.0
    guard.least_N, guard.most_N = math.inf, -math.inf
    guard.turned = 1
    guard.given_J = _excess_energy(guard)  # an excess outlives it
    guard.budget_J = 0.0
    guard.driven = 0
    guard.saturated = 0


@njit()
def check_reading(
    guard: GuardState, limits: DeviceLimits, reading: Reading, now_ns: int, span_s: float
) -> int:
    """Check a reading before it is rendered from: NO_FAULT, or the fault's code. Comparisons are written so that NaN
    fails them.
    """
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
    if not span_s <= STALL_PAUSE_S:
        guard.stalls += 1
        release_force(guard)
    if not limits.lowest_m <= reading.z_m <= limits.highest_m:
        release_force(guard)  # the force has faded before; it comes back by the ramp from above the head
    return NO_FAULT


@njit()
def check_speed(limits: DeviceLimits, v: float) -> int:
    """Check the stick's speed: NO_FAULT or TOO_FAST; NaN is too fast."""
    return NO_FAULT if abs(v) <= limits.max_speed_m_per_s else TOO_FAST


@njit()
def advance_ramp(guard: GuardState, limits: DeviceLimits, reading: Reading, z: float, period_s: float) -> int:
    """Check the dead man's button and move the ramp on: NO_FAULT, or DEAD_MAN while the button is not held."""
    if limits.dead_man != 0 and reading.buttons == 0:
        release_force(guard)
        return DEAD_MAN
    if guard.seen_above == 0:
        if z > _SEEN_ABOVE_M:
            guard.seen_above = 1
        guard.gain = 0.0
        return NO_FAULT
    guard.gain = min(1.0, guard.gain + period_s / limits.ramp_s)
    return NO_FAULT


@njit()
def rebound_bounds(law: Law) -> tuple[float, float]:
    """Bounds e and b of drumstick.safety.bounds without the pulses: a contact may end at e |v_in| + b."""
    return bounds.max_restitution_by_head(law), bounds.max_added_speed_by_head(law)


@njit()
def _energy(limits: DeviceLimits, speed: float) -> float:
    return 0.5 * float(limits.m_kg) * speed * speed


@njit()
def begin_contact(guard: GuardState, limits: DeviceLimits, m: float, v_in: float, now_ns: int) -> int:
    """Set the energy budget of the contact that begins at v_in: NO_FAULT, or SELF_DRIVEN.

    The head may give back what it took, and what its effects are meant to add: the contact may end at
    guard.max_restitution |v_in| + guard.max_added_speed (drumstick.safety.bounds), without its pulses. A live m above
    the arm's own does not raise the budget. An excess of the contact before is carried over; energy that it kept is
    not.
    """
    speed = abs(v_in)
    leaving = guard.max_restitution * speed + guard.max_added_speed
    added = leaving * leaving - speed * speed
    excess_J = _excess_energy(guard)
    guard.given_J = excess_J
    guard.budget_J = 0.5 * min(m, limits.m_kg) * (max(added, 0.0) - _KEPT * speed * speed)
    guard.blow_J = _energy(limits, speed)
    has_excess = excess_J > _energy(limits, _EXCESS_M_PER_S) and speed > _EXCESS_M_PER_S
    guard.driven = guard.driven + 1 if has_excess else 0
    soon = now_ns - guard.entry_ns < _FASTEST_HAND_NS
    at_the_limit = guard.peak_N >= _AT_THE_LIMIT * limits.max_force_N
    if soon and at_the_limit and guard.pulsed == 0 and speed > _UNTIRED * guard.first_m_per_s:
        guard.saturated += 1
    else:
        guard.saturated = 0
        guard.first_m_per_s = speed
    guard.entry_ns = now_ns
    guard.turned = 0
    guard.peak_N = 0.0
    guard.pulsed = 0
    return SELF_DRIVEN if max(guard.driven, guard.saturated) > _MAX_DRIVEN else NO_FAULT


@njit()
def check_energy(guard: GuardState, limits: DeviceLimits) -> int:
    """Check the observed energy: NO_FAULT, or SELF_DRIVEN where the head has given far more than its budget."""
    most = max(_energy(limits, _FAULT_EXCESS_M_PER_S), _FAULT_EXCESS_SHARE * guard.blow_J)
    return NO_FAULT if _excess_energy(guard) <= most else SELF_DRIVEN


@njit()
def _observe_energy(guard: GuardState, limits: DeviceLimits, z: float) -> None:
    # Adds the work of the head's force that acted over the last tick: of a tick ago, or earlier by the device's own
    # delay. A count that flips to and fro is no motion, though force and count flip together: moves of less than two
    # counts wait. A stick that trembles in the head by two counts then gets the newest force both ways, and its account
    # stays where it is. A blow would get too little on its way up by that: until it has turned, only the last tick has
    # that force, those before it the mean of their extremes, exact for a spring; and the turn is charged what the
    # stick may have got by going to and fro unseen, _TURN_COUNTS against the least force and with the most.
    acted = guard.head_N[(guard.newest - limits.delay_ticks) % MEMORY]
    way = z - guard.counted_m
    if abs(way) > _MOTION_COUNTS * limits.resolution_m:
        if guard.turned == 0 and guard.least_N <= guard.most_N:
            guard.given_J += 0.5 * (guard.least_N + guard.most_N) * (guard.z_m - guard.counted_m)
            guard.given_J += acted * (z - guard.z_m)
            if way > 0.0:
                guard.given_J += (guard.most_N - guard.least_N) * _TURN_COUNTS * limits.resolution_m
        else:
            guard.given_J += acted * way
        if way > 0.0:
            guard.turned = 1
        guard.counted_m = z
        guard.least_N, guard.most_N = math.inf, -math.inf
    else:
        guard.least_N = min(guard.least_N, acted)
        guard.most_N = max(guard.most_N, acted)
    guard.z_m = z


@njit()
def _max_force(v: float, left_J: float, c: float, period_s: float) -> float:
    # The largest force F >= 0 that gives a stick at v no more than left_J in a tick: F (v T + c F) <= left_J, where
    # c F = F T^2/(2m) is how far F itself moves it. Where no energy is left, the force that takes most from a stick
    # that comes.
    way = v * period_s
    inside = way * way + 4.0 * c * left_J
    if inside < 0.0:
        return max(-0.5 * way / c, 0.0)
    return max((math.sqrt(inside) - way) / (2.0 * c), 0.0)


@njit()
def _passive_range(guard: GuardState, limits: DeviceLimits, v: float, period_s: float) -> tuple[float, float]:
    # The least and the largest force with which the head may push now, N: the passivity controller. Hannaford's and
    # Ryu's adds damping; this one limits the head's force, which cannot overshoot. Within a contact the observer is
    # never reset, not even for a stick at rest: a head that is pressed has taken energy, and pushes back out of that.
    #
    # The estimate of v is half a tick late at least, and forces on their way act before this one.
    seen, c = v, 0.5 * period_s * period_s / limits.m_kg
    acting = guard.head_N[(guard.newest - limits.delay_ticks) % MEMORY]
    v += 0.5 * period_s * max(acting, 0.0) / limits.m_kg
    left_J = guard.budget_J - guard.given_J
    for back in range(limits.delay_ticks - 1, -1, -1):
        coming = guard.head_N[(guard.newest - back) % MEMORY]
        left_J -= coming * (v * period_s + c * coming)
        v += coming * period_s / limits.m_kg
    most = _max_force(v, left_J, c, period_s)
    # A stick that rests in the head may always be held, with what makes it _SLOW_M_PER_S at most. So may one that rises
    # more slowly, for a count that flips looks like that: a hold that let go at each flip would shake a light arm by
    # two counts for ever.
    most = max(most, (_SLOW_M_PER_S - max(seen, 0.0)) * limits.m_kg / period_s)
    return -_max_force(-v, left_J, c, period_s), most


@njit()
def _faded(limits: DeviceLimits, z: float, head_z_m: float) -> float:
    # The share of the head's force near the lowest position: the workspace ends softly.
    return min(max((z + head_z_m - limits.lowest_m) / _SOFT_M, 0.0), 1.0)


@njit()
def limit(
    guard: GuardState,
    limits: DeviceLimits,
    head_N: float,
    pulse_N: float,
    z: float,
    v: float,
    period_s: float,
) -> float:
    """Limit the forces of head and pulses, both finite, N, to the force that goes to the motors, N.

    The observer counts forces that really go out. While the ramp rises a head takes little of a blow and could give
    back all of it; a force that may only fall slowly would push on behind a stick that has left. Ramp and fade are
    shares of the motors' limit, since a deep press asks for far more than that.
    """
    _observe_energy(guard, limits, z)
    share = guard.gain * _faded(limits, z, limits.head_z_m)
    wanted = share * head_N + guard.gain * pulse_N
    head_N = share * min(max(head_N, -limits.max_force_N), limits.max_force_N)
    pulse_N *= guard.gain
    least, most = _passive_range(guard, limits, v, period_s)
    force = min(max(head_N + pulse_N, -limits.max_force_N), limits.max_force_N)
    step = limits.max_slew_N_per_s * period_s
    force = min(max(force, guard.force_N - step), guard.force_N + step)
    if not least <= force - pulse_N <= most:
        guard.passivity_limited_ticks += 1
        kept = min(max(force - pulse_N, least), most)
        force = min(max(kept + pulse_N, -limits.max_force_N), limits.max_force_N)
    if not abs(force) <= limits.max_force_N:  # NaN: nothing finite came in
        force = 0.0
    if force != wanted:
        guard.limited += 1
    guard.newest = (guard.newest + 1) % MEMORY
    guard.head_N[guard.newest] = max(
        force - pulse_N, min(head_N, 0.0)
    )  # what a limit takes, it takes from the pulse
    guard.force_N = force
    guard.peak_N = max(guard.peak_N, abs(force))
    if pulse_N != 0.0:
        guard.pulsed = 1
    return force


@njit()
def last_head_force(guard: GuardState) -> float:
    """Share of the head in the force that went out last, N."""
    return guard.head_N[guard.newest]
