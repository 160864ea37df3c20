"""The law for a device that a hand holds: from its position to the force on its motors, once a tick.

The hand supplies m, K_hand and R_out; only the head and the pulses are rendered. Position comes at ticks and the force
is held until the next, so everything is seen late: the position is led by T/2 and the device's own delay. Events,
effects and records go through the same code as the exact stick (drumstick.stick.motion.transitions,
drumstick.stick.composition). Tick thread: no allocation, no locks, no Python, no exceptions.
"""

import math

from drumstick.safety.sampled_contact import slow_rebound_reduction
from drumstick.stick import composition
from drumstick.stick.motion import exact, transitions
from drumstick.stick.motion.events import DESCENT
from haptic_server.block_header import HEARTBEAT, HELD, PANICS_SEEN
from haptic_server.records import NO_FAULT, OUT_OF_BOUNDS, Reading
from haptic_server.servo.force import guard, hand_estimate, streaming
from haptic_server.servo.force.event_output import end_contact, note_release, note_strike
from haptic_server.servo.force.latch import latch_heard, latch_in_hand
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.orders import NOTHING, held_code, obey
from haptic_server.servo.force.velocity import follow, forget
from realtime.atomics import store_release
from realtime.kernels.jit import njit, only_with

_CLEAR_OF_HEAD = 2.0  # resolutions above z = 0: a stick that lies on the head must not chatter


@njit()
def _release_force(servo: Servo, now_ns: int) -> None:
    composition.stop(servo.law[0], servo.motion[0])
    end_contact(servo, now_ns)
    guard.release_force(servo.guard[0])


@njit()
def _orders(servo: Servo, now_ns: int) -> None:
    if obey(servo) != NOTHING:
        _release_force(servo, now_ns)


@njit()
def _latch(servo: Servo) -> None:
    if latch_in_hand(servo):
        servo.guard[0].max_restitution, servo.guard[0].max_added_speed = guard.rebound_bounds(servo.law[0])


@njit()
def _enter(servo: Servo, ahead_m: float, now_ns: int) -> None:
    # ahead_m: how far above the head the stick really is; the lead has seen the contact before it happens.
    law, motion = servo.law[0], servo.motion[0]
    transitions.apply(law, motion, exact.ENTRY)
    servo.tick_state[0].fault = guard.begin_contact(
        servo.guard[0], servo.device_limits[0], law.m, motion.v_in, now_ns
    )
    # Between the last tick and as far ahead as is led: a slow stick that the last contact left below z = 0 is no nearer
    # to its instant by z/v than now.
    plan = servo.plan[0]
    early_s = (
        min(max(ahead_m / -motion.v_in, -plan.period_ns * 1e-9), plan.lead_s) if motion.v_in < 0.0 else 0.0
    )
    note_strike(servo, now_ns + int(early_s * 1e9))


@njit()
def detect_events(servo: Servo, z: float, v: float, now_ns: int) -> None:
    """Lead the position and note what it passes: entry, turn, release. The stick is at z m, v m/s now."""
    law, motion = servo.law[0], servo.motion[0]
    before, above = motion.v, motion.z
    motion.z = z + v * servo.plan[0].lead_s
    motion.v = v
    tick_state = servo.tick_state[0]
    tick_state.force_reduction = slow_rebound_reduction(
        tick_state.force_reduction, above, tick_state.last_nonzero_v, motion.z, v
    )
    if v != 0.0:
        tick_state.last_nonzero_v = v
    if motion.contact_phase == exact.ABOVE:
        if motion.z < 0.0 and v < 0.0:
            _enter(servo, z, now_ns)
    elif motion.z > _CLEAR_OF_HEAD * servo.device_limits[0].resolution_m:
        transitions.apply(law, motion, exact.RELEASE)
        note_release(servo, now_ns)
    elif v >= 0.0 and (motion.turned == 0 or before < 0.0):
        transitions.apply(law, motion, exact.TURN)
    elif v < 0.0 and before >= 0.0 and motion.turned != 0:
        transitions.apply(law, motion, DESCENT)
    motion.outcome = exact.MOVING  # a hand can always lift it


@njit()
def requested_forces(servo: Servo, period_s: float) -> tuple[float, float]:
    """Forces that the head and the pulses ask for over the coming tick, N, before the guard.

    A pulse's held force is its mean over the tick, so that it gives m dv in all, whatever T:
    h0 = m dv (1 - exp(-T/tau))/T.
    """
    law, motion = servo.law[0], servo.motion[0]
    transitions.renew(law, motion)
    # Strikes are told apart two counts above the head, but up there the head neither pushes nor pulls.
    head_N = transitions.force_now(law, motion) if motion.z < 0.0 else 0.0
    if motion.v >= 0.0:
        head_N *= 1.0 - servo.tick_state[0].force_reduction
    before = composition.remaining_speed(law, motion)
    composition.elapse(law, motion, period_s, composition.fades(law, period_s))
    return head_N, law.m * (before - composition.remaining_speed(law, motion)) / period_s


@njit()
def _keep(servo: Servo, period_s: float) -> None:
    # The contact's record: of the head as it is felt, which the guard may have held back.
    motion = servo.motion[0]
    if motion.contact_phase != exact.ABOVE:
        felt_N = guard.last_head_force(servo.guard[0])
        motion.contact_s += period_s
        motion.z_min = min(motion.z_min, motion.z)
        motion.peak_N = max(motion.peak_N, felt_N)
        motion.impulse_N_s += felt_N * period_s


@only_with("hand")
def observe_hand(servo: Servo, z: float, now_ns: int) -> None:
    """The arm is at z m now, and the force of the tick before this one has acted on it."""
    hand_estimate.update_observer(
        servo.hand[0],
        servo.law[0],
        servo.tick_state[0].force_N,
        servo.device_limits[0].delay_ticks,
        z,
        now_ns,
    )


@njit()
def _rendered(servo: Servo, reading: Reading, now_ns: int, span_s: float) -> float:
    tick_state, plan = servo.tick_state[0], servo.plan[0]
    held, limits = servo.guard[0], servo.device_limits[0]
    period_s = plan.period_ns * 1e-9
    if held.seen_above == 0 and span_s > guard.STALL_PAUSE_S:
        forget(servo.track[0])
    z = reading.z_m - plan.head_z_m
    v = follow(servo.track[0], now_ns * 1e-9, z, limits.resolution_m)
    observe_hand(servo, z, now_ns)
    tick_state.fault = guard.check_speed(limits, v)
    if tick_state.fault != NO_FAULT:
        return 0.0
    if guard.advance_ramp(held, limits, reading, z, period_s) != NO_FAULT or held.seen_above == 0:
        if servo.motion[0].contact_phase != exact.ABOVE:
            _release_force(servo, now_ns)
        servo.motion[0].z, servo.motion[0].v = z, v  # no force, but the motion follows the reading
        _latch(servo)
        return 0.0
    detect_events(servo, z, v, now_ns)
    if tick_state.fault != NO_FAULT:
        return 0.0
    if servo.motion[0].contact_phase == exact.ABOVE:
        _latch(servo)
    head_N, pulse_N = requested_forces(servo, period_s)
    if not abs(head_N + pulse_N) < math.inf:
        tick_state.fault = OUT_OF_BOUNDS
        return 0.0
    force = guard.limit(held, limits, head_N, pulse_N, z, v, period_s)
    tick_state.fault = guard.check_energy(held, limits)
    if tick_state.fault != NO_FAULT:
        return 0.0
    _keep(servo, period_s)
    return force


@njit()
def render(servo: Servo, reading: Reading, now_ns: int, span_s: float) -> float:
    """The force along z, N, up to the next tick; `span_s` is the time since the last one."""
    control, tick_state, plan = servo.block.control, servo.tick_state[0], servo.plan[0]
    streaming.held_tick(servo, now_ns)
    _orders(servo, now_ns)
    latch_heard(servo)
    force = 0.0
    if tick_state.fault == NO_FAULT:
        tick_state.fault = guard.check_reading(
            servo.guard[0], servo.device_limits[0], reading, now_ns, span_s
        )
    if tick_state.fault == NO_FAULT and tick_state.panicked == 0:
        tick_state.x = min(max(reading.x_m / plan.reach_m, -1.0), 1.0)
        tick_state.y = min(max(reading.y_m / plan.reach_m, -1.0), 1.0)
        force = _rendered(servo, reading, now_ns, span_s)
    if tick_state.fault != NO_FAULT or tick_state.panicked != 0:
        _release_force(servo, now_ns)
        _latch(servo)
        force = 0.0
    streaming.settle(servo)
    tick_state.force_N = force
    store_release(control, HELD, held_code(tick_state))
    store_release(control, PANICS_SEEN, tick_state.panics_seen)
    store_release(control, HEARTBEAT, now_ns)
    return force
