"""One tick of the simulated arm (move under the held force, measure the position, render, obey) or of a recording.

Tick thread: no allocation, no locks, no Python, no exceptions. The same code runs in real time and in virtual time.
"""

from drumstick.stick.hand_path import HOLD
from haptic_server.servo.force import gestured_hand
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.rendering import render
from haptic_server.servo.force.strike_positions import advance_orbit
from haptic_server.servo.simulation import device_parts, phantom, playback
from realtime.kernels.jit import njit


@njit()
def _lift_when_dead(servo: Servo, span_s: float) -> None:
    # A hand that only holds would leave a stick that lies dead in the head there for ever: so it lifts it again. Its
    # speed says nothing: encoder counts may keep a dead stick trembling.
    plant, tick_state, plan = servo.plant[0], servo.tick_state[0], servo.plan[0]
    dead = servo.gesture[0].kind == HOLD and plant.z_m < plan.head_z_m
    tick_state.still_s = tick_state.still_s + span_s if dead else 0.0
    if tick_state.still_s >= plan.rest_s:
        tick_state.still_s = 0.0
        plant.t_s = 0.0


@njit()
def sampled_tick(servo: Servo, now_ns: int, span_s: float) -> None:
    """Advance to `now_ns` over the `span_s` seconds before it, and set the force for the time after it."""
    plant, reading, tick_state, plan = servo.plant[0], servo.reading[0], servo.tick_state[0], servo.plan[0]
    gestured_hand.grip(servo, tick_state.max_entry_speed)
    phantom.carry(plant, servo.gesture[0], servo.path, span_s, tick_state.max_entry_speed)
    phantom.measure(plant, reading, now_ns)
    advance_orbit(tick_state, plan, span_s)
    reading.x_m = tick_state.x * plan.reach_m
    reading.y_m = tick_state.y * plan.reach_m
    phantom.apply_force(plant, render(servo, reading, now_ns, span_s))
    _lift_when_dead(servo, span_s)


@njit()
def own_device_tick(servo: Servo, now_ns: int, span_s: float) -> None:
    """Read another package's device, render, and give it the force."""
    own, reading = servo.own[0], servo.reading[0]
    device_parts.measure(own, reading, now_ns, span_s)
    device_parts.write(own, render(servo, reading, now_ns, span_s))


@njit()
def replayed_tick(servo: Servo, now_ns: int, span_s: float) -> None:
    """Follow the recording by `span_s` and render; nobody feels the force."""
    playback.measure(servo.replay[0], servo.path, servo.plan[0].head_z_m, servo.reading[0], now_ns, span_s)
    render(servo, servo.reading[0], now_ns, span_s)
