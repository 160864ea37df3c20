"""One tick of a stick whose hand follows a pointer: the paper's stick itself, or the simulated arm.

Nobody throws this stick or lifts it when it lies dead: whoever points does. Tick thread: no allocation, no locks, no
Python, no exceptions. The same code runs in real time and in virtual time.
"""

from drumstick.safety.entry_speed import speed_ahead
from drumstick.stick import composition
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from haptic_server.servo.force.latch import latch
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.rendering import render
from haptic_server.servo.force.tick import advance, begin, conclude
from haptic_server.servo.simulation import phantom
from haptic_server.servo.simulation.pointed_hand import follow, height_of
from realtime.kernels.jit import njit

_WITHIN_M = 0.01  # the arm's hand stays so far inside what the guard allows


@njit()
def _within_speed(law: Law, motion: Motion, wanted_m: float, before_m: float, max_speed: float) -> float:
    # A hand that swings in time with the stick would pump it up beyond every limit: it stands where it last stood while
    # its spring would make more of the stick's height than `max_speed` m/s, and more than it makes now. Where it stands
    # the envelope has not looked: a flight that could gain too much there gains no more. While the stick is still in
    # the head, how fast that flight will be is not known: the hand waits for it.
    pulses = composition.most_remaining_speed(law, motion)
    if speed_ahead(law, motion, before_m, pulses) > max_speed:
        if motion.contact_phase == exact.ABOVE:
            composition.end_gain(law, motion)
        elif composition.flight_growth(law, motion) > 1.0:
            return before_m
    speed = speed_ahead(law, motion, wanted_m, pulses)
    if speed <= max(max_speed, speed_ahead(law, motion, before_m, pulses)):
        return wanted_m
    return before_m


@njit()
def _advance_held(servo: Servo, now_ns: int, span_s: float) -> None:
    # The law's z_ss is where the hand holds its spring: for this tick it stands where the hand is. A set that is
    # latched in the middle of the tick brings its own z_ss, which then stays.
    law, tick_state = servo.law[0], servo.tick_state[0]
    rest_m, revision, hand = law.z_ss, tick_state.revision, servo.pointed[0]
    wanted_m = height_of(hand, rest_m)
    law.z_ss = _within_speed(law, servo.motion[0], wanted_m, hand.stands_m, tick_state.max_entry_speed)
    hand.stands_m = law.z_ss
    advance(servo, now_ns, span_s)
    if tick_state.revision == revision:
        law.z_ss = rest_m


@njit()
def pointed_stick_tick(servo: Servo, now_ns: int, span_s: float) -> None:
    """Advance the exact stick to `now_ns` over the `span_s` seconds before it."""
    hand, motion, tick_state = servo.pointed[0], servo.motion[0], servo.tick_state[0]
    span_s = begin(servo, now_ns, span_s)
    follow(hand, servo.block, servo.law[0].z_ss, now_ns, span_s)
    tick_state.x, tick_state.y = hand.x, hand.y
    if tick_state.panicked != 0 or tick_state.fault != 0:
        latch(servo)
    else:
        motion.outcome = exact.MOVING  # a hand can always lift it
        if motion.z > 0.0:
            latch(servo)
        _advance_held(servo, now_ns, span_s)
    conclude(servo, now_ns)


@njit()
def pointed_arm_tick(servo: Servo, now_ns: int, span_s: float) -> None:
    """Move the arm on, measure where it is, render, obey."""
    hand, plant, reading = servo.pointed[0], servo.plant[0], servo.reading[0]
    limits, plan = servo.device_limits[0], servo.plan[0]
    rest_m = servo.law[0].z_ss
    follow(hand, servo.block, rest_m, now_ns, span_s)
    wanted_m = plan.head_z_m + height_of(hand, rest_m)
    wanted_m = min(max(wanted_m, limits.lowest_m + _WITHIN_M), limits.highest_m - _WITHIN_M)
    phantom.lead(plant, wanted_m, servo.tick_state[0].max_entry_speed)
    phantom.move_on(plant, span_s)
    phantom.measure(plant, reading, now_ns)
    reading.x_m = hand.x * plan.reach_m
    reading.y_m = hand.y * plan.reach_m
    phantom.apply_force(plant, render(servo, reading, now_ns, span_s))
