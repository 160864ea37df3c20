"""One tick of the simulated arm: move under the held force, tell the position, render, obey.

Tick thread: no allocation, no locks, no Python, no exceptions. The same text runs in real time and in virtual time.
"""

from haptic_server.device import phantom
from haptic_server.servo.memory import Servo
from haptic_server.servo.orbit import walk
from haptic_server.servo.rendering import render
from realtime.jit import njit


@njit()
def sampled_tick(servo: Servo, now_ns: int, span_s: float) -> None:
    """Advance to `now_ns` over the `span_s` seconds before it, and set the force for the time after it."""
    plant, reading, player, plan = servo.plant[0], servo.reading[0], servo.player[0], servo.plan[0]
    phantom.carry(plant, servo.gesture[0], servo.path, span_s)
    phantom.tell(plant, reading, now_ns)
    walk(player, plan, span_s)
    reading.x_m = player.x * plan.reach_m
    reading.y_m = player.y * plan.reach_m
    phantom.obey(plant, render(servo, reading, now_ns, span_s))
