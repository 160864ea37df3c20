"""A simulated arm that falls on the rendered head: what does the head give back? For the benchmark and its tests.

Any thread; no allocation. The very text that plays: the arm's plant, the velocity estimate, the law, and the guard's
energy account or not.
"""

from drumstick.events import ABOVE
from haptic_server.device import phantom
from haptic_server.servo import guard
from haptic_server.servo.memory import Servo
from haptic_server.servo.rendering import ask, see
from haptic_server.servo.velocity import follow, forget
from realtime.jit import njit
from realtime.lent import lend

_FROM_M = 0.02
_CLEAR_M = 0.004
_MOST_TICKS = 40_000


@njit()
def fall(servo: Servo, speed: float, phase: float, guarded: bool) -> float:
    """Fall at `speed` m/s from 20 mm, `phase` (0..1) of a tick late; returns the rebound's speed over it.

    Negative when the arm does not come back within 40,000 ticks. servo: of a scene with the plant `phantom`; a hand or
    friction would take part.
    """
    servo = lend(servo)
    plant, motion, plan, held = servo.plant[0], servo.motion[0], servo.plan[0], servo.guard[0]
    period_s = plan.period_ns * 1e-9
    forget(servo.track[0])
    guard.let_go(held)
    held.seen_above = 1
    held.gain = 1.0
    motion.place = ABOVE
    motion.v = -speed
    plant.z_m = plan.head_z_m + _FROM_M + phase * speed * period_s
    plant.v_m_per_s = -speed
    plant.force_N = 0.0
    for tick in range(1, _MOST_TICKS):
        phantom.move_on(plant, period_s)
        phantom.tell(plant, servo.reading[0], tick * plan.period_ns)
        z = servo.reading[0].z_m - plan.head_z_m
        v = follow(servo.track[0], tick * period_s, z, servo.allowed[0].resolution_m)
        see(servo, z, v, tick * plan.period_ns)
        head_N, pulse_N = ask(servo, period_s)
        if guarded:
            phantom.obey(plant, guard.limit(held, servo.allowed[0], head_N, pulse_N, z, v, period_s))
        else:
            phantom.obey(plant, head_N + pulse_N)
        if plant.z_m > plan.head_z_m + _CLEAR_M and plant.v_m_per_s > 0.0:
            return plant.v_m_per_s / speed
    return -1.0
