"""Output of the servo: strikes and releases into the ring, its status after each tick.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from drumstick.stick import composition
from drumstick.stick.contact_ahead import contact_ahead
from drumstick.stick.motion import exact
from drumstick.stick.strike_curve import level_of
from haptic_server.records import FAULT, PANIC, PLAYING, READY, RELEASE, STRIKE
from haptic_server.servo.force import hand_estimate, streaming
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.orders import forget_arm
from realtime import ring, triple_buffer
from realtime.kernels.jit import njit, only_with

_STILL_PLAYING_NS = 2_000_000_000


@only_with("hand")
def foresee_hand(servo: Servo) -> None:
    """Write into servo.ahead_law the law with the hand as it pulls now; without a hand to estimate it is the law."""
    servo.ahead_law[0] = servo.law[0]
    hand_estimate.write_predicted_hand(servo.hand[0], servo.ahead_law[0])


@njit()
def note_strike(servo: Servo, t_ns: int) -> None:
    """Put the contact that has just begun into the ring: t_ns is its instant."""
    motion, tick_state, event = servo.motion[0], servo.tick_state[0], servo.event[0]
    speed = -motion.v_in
    tick_state.seq += 1
    streaming.begin(servo)
    first, second = tick_state.before_last_ns, tick_state.last_ns
    tick_state.roll_rate_Hz = 0.0
    if second > 0 and t_ns > second:
        # Over two intervals when both are recent: a roll of period two shows its mean rate.
        both = first > 0 and t_ns - first < _STILL_PLAYING_NS
        tick_state.roll_rate_Hz = 2e9 / (t_ns - first) if both else 1e9 / (t_ns - second)
    tick_state.before_last_ns = second
    tick_state.last_ns = t_ns
    event.kind = STRIKE
    event.seq = tick_state.seq
    event.t_ns = t_ns
    event.x = tick_state.x
    event.y = tick_state.y
    event.speed_m_per_s = speed
    foresee_hand(servo)
    ahead = contact_ahead(servo.ahead_law[0], motion, servo.ahead)
    event.peak_N = min(ahead.peak_N, servo.device_limits[0].max_force_N)
    event.contact_s = ahead.contact_s
    event.impulse_N_s = ahead.impulse_N_s
    event.level = level_of(servo.curve[0], speed)
    ring.push(servo.block.ring_cells, servo.block.events, event)


@njit()
def note_release(servo: Servo, t_ns: int) -> None:
    """Put the contact that has just ended into the ring."""
    law, motion, tick_state, event = servo.law[0], servo.motion[0], servo.tick_state[0], servo.event[0]
    tick_state.v_e_m_per_s = motion.v_out + composition.remaining_speed(law, motion)
    streaming.end(servo)
    event.kind = RELEASE
    event.seq = tick_state.seq
    event.t_ns = t_ns
    event.speed_m_per_s = motion.v_out
    event.impulse_N_s = motion.impulse_N_s
    event.contact_s = motion.contact_s
    event.level = 0.0
    event.peak_N = motion.peak_N
    ring.push(servo.block.ring_cells, servo.block.events, event)


@njit()
def end_contact(servo: Servo, now_ns: int) -> None:
    """End a contact from outside: whoever takes the stick out of the head, no note may hang."""
    motion = servo.motion[0]
    if motion.contact_phase != exact.ABOVE:
        motion.v_out = 0.0
        motion.z = 0.0
        if not (abs(motion.impulse_N_s) < 1e6 and motion.contact_s < 1e6 and motion.peak_N < 1e6):
            motion.impulse_N_s = motion.contact_s = motion.peak_N = 0.0  # a fault's numbers go nowhere
            streaming.forget(servo)
        motion.contact_phase = exact.ABOVE
        note_release(servo, now_ns)


@njit()
def publish_status(servo: Servo, now_ns: int) -> None:
    """Publish how the servo stands after a tick; the caller has filled tick, overruns and lateness."""
    motion, tick_state, status = servo.motion[0], servo.tick_state[0], servo.status[0]
    since_strike = now_ns - tick_state.last_ns
    forget_arm(servo)
    status.t_ns = now_ns
    status.status = READY
    if tick_state.last_ns > 0 and since_strike < _STILL_PLAYING_NS:
        status.status = PLAYING
    if tick_state.panicked != 0:
        status.status = PANIC
    if tick_state.fault != 0:
        status.status = FAULT
    status.fault = tick_state.fault
    status.z_m = motion.z
    status.v_m_per_s = motion.v
    status.force_N = tick_state.force_N
    status.x = tick_state.x
    status.y = tick_state.y
    status.roll_rate_Hz = tick_state.roll_rate_Hz if status.status == PLAYING else 0.0
    status.v_e_m_per_s = tick_state.v_e_m_per_s
    status.strikes = tick_state.seq
    status.revision = tick_state.revision
    status.refused = tick_state.refused
    status.refused_revision = tick_state.refused_revision
    triple_buffer.publish(servo.block.status_cells, servo.block.status, status)
