"""One tick of the simulated stick: latch parameters, advance the physics, note strikes, tell how it stands.

Tick thread: no allocation, no locks, no Python, no exceptions. The same code runs in real time and in virtual time.
"""

from drumstick.stick import composition
from drumstick.stick.motion import exact, transitions
from haptic_server import permission
from haptic_server.block_header import HEARTBEAT, HELD, PANICS_SEEN
from haptic_server.records import NO_FAULT, OUT_OF_BOUNDS
from haptic_server.servo.force import gestured_hand, streaming
from haptic_server.servo.force.event_output import end_contact, note_release, note_strike
from haptic_server.servo.force.latch import latch, latch_heard
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.orders import NOTHING, held_code, obey
from haptic_server.servo.force.strike_positions import advance_orbit
from realtime.atomics import store_release
from realtime.kernels.jit import njit

_EVENTS_IN_A_TICK = 64  # more is a stick that buzzes faster than anything audible
_STILL_M_PER_S = 1e-3
_MAX_SPAN_TICKS = 20  # after a longer stall the stick has simply stood still
_ARM = permission.ARM


@njit()
def _lift_away(servo: Servo, now_ns: int) -> None:
    # Panic on the simulated stick: no force acts on it and it touches nothing.
    motion = servo.motion[0]
    composition.stop(servo.law[0], motion)
    end_contact(servo, now_ns)
    motion.v = 0.0
    motion.outcome = exact.LEFT


@njit()
def advance(servo: Servo, now_ns: int, span_s: float) -> None:
    """Move the stick by `span_s` up to `now_ns`, noting what it meets."""
    moved = 0.0
    for _ in range(_EVENTS_IN_A_TICK):
        what, duration = exact.advance(servo.law[0], servo.motion[0], span_s - moved)
        moved += duration
        t_ns = now_ns - int((span_s - moved) * 1e9)
        if what == exact.ENTRY:
            note_strike(servo, t_ns)
        elif what == exact.RELEASE:
            note_release(servo, t_ns)
            latch(servo)  # at z = 0, going up: a buzz may never be seen above the head
            gestured_hand.release(servo)
        elif what == exact.HORIZON:
            gestured_hand.may_lift(servo)
            return
    # A stick that buzzes faster than anything audible would take the tick over: the player takes it off the head.
    _lift_away(servo, now_ns)


@njit()
def _watch_still(servo: Servo, span_s: float) -> None:
    # A stick that creeps in the head, by whatever law, is dead too; and one that has flown so high that a waiting set
    # cannot take over safely is fetched.
    motion, tick_state, plan = servo.motion[0], servo.tick_state[0], servo.plan[0]
    creeping = motion.contact_phase != exact.ABOVE and abs(motion.v) <= _STILL_M_PER_S
    too_high = motion.contact_phase == exact.ABOVE and tick_state.is_pending != 0
    if not (creeping or too_high):
        tick_state.still_s = 0.0
        return
    tick_state.still_s += span_s
    if tick_state.still_s >= plan.rest_s:
        tick_state.still_s = 0.0
        tick_state.rest_s = plan.rest_s if too_high else 0.0
        motion.outcome = exact.CAPTURED


@njit()
def _rest(servo: Servo, now_ns: int, span_s: float) -> None:
    # A stick that lies dead in the head, or has left for good, is thrown again after a while, as `simulate` starts.
    motion, tick_state, plan = servo.motion[0], servo.tick_state[0], servo.plan[0]
    tick_state.rest_s += span_s
    if tick_state.rest_s < plan.rest_s:
        return
    tick_state.rest_s = 0.0
    _lift_away(servo, now_ns)
    motion.z = 0.0
    motion.v = plan.throw_m_per_s
    motion.outcome = exact.MOVING
    latch(servo)


@njit()
def _orders(servo: Servo, now_ns: int) -> None:
    order = obey(servo)
    if order == _ARM:
        servo.tick_state[0].rest_s = servo.plan[0].rest_s  # thrown on this very tick
    if order != NOTHING:
        _lift_away(servo, now_ns)


@njit()
def begin(servo: Servo, now_ns: int, span_s: float) -> float:
    """Obey panic and arm; returns the span that this tick advances by, s."""
    streaming.exact_tick(servo, now_ns)
    _orders(servo, now_ns)
    return min(span_s, _MAX_SPAN_TICKS * servo.plan[0].period_ns * 1e-9)


@njit()
def conclude(servo: Servo, now_ns: int) -> None:
    """Fault what cannot be, note the force, and show the gateway that the servo lives."""
    control, motion, tick_state = servo.block.control, servo.motion[0], servo.tick_state[0]
    if tick_state.fault == NO_FAULT and not (abs(motion.z) < 1e3 and abs(motion.v) < 1e3):
        tick_state.fault = OUT_OF_BOUNDS
        motion.z = 0.0
        _lift_away(servo, now_ns)
    streaming.settle(servo)
    tick_state.force_N = transitions.force_now(servo.law[0], motion) if motion.outcome != exact.LEFT else 0.0
    store_release(control, HELD, held_code(tick_state))
    store_release(control, PANICS_SEEN, tick_state.panics_seen)
    store_release(control, HEARTBEAT, now_ns)


@njit()
def tick(servo: Servo, now_ns: int, span_s: float) -> None:
    """Advance to `now_ns` over the `span_s` seconds before it."""
    motion, tick_state = servo.motion[0], servo.tick_state[0]
    span_s = begin(servo, now_ns, span_s)
    advance_orbit(tick_state, servo.plan[0], span_s)
    gestured_hand.put_back(servo)
    latch_heard(servo)
    if tick_state.panicked != 0 or tick_state.fault != 0:
        latch(servo)
    else:
        if motion.outcome != exact.MOVING:
            _rest(servo, now_ns, span_s)
        elif motion.z > 0.0:
            latch(servo)
        gestured_hand.follow(servo, span_s)
        if motion.outcome != exact.LEFT:
            advance(servo, now_ns, span_s)
            _watch_still(servo, span_s)
    conclude(servo, now_ns)
