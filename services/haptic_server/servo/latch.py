"""When a set of parameters takes effect: whole, above the head, inside the envelope, without throwing the stick.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from drumstick import composition, envelope
from haptic_server.servo.memory import Servo
from realtime import triple
from realtime.jit import Record, njit


@njit()
def fits(law: Record, plan: Record) -> bool:
    """The servo's own fence: is this set inside the envelope of scene and device? It trusts nobody."""
    if envelope.check(law, plan.max_force_N, plan.max_speed_m_per_s) != envelope.OK:
        return False
    return envelope.check_sampled(law, plan.stiffness_N_per_m, plan.lag_s, 0.0) == envelope.OK


@njit()
def latch(servo: Servo) -> bool:
    """Take the newest set that waits, if now is the moment; call it only at z >= 0. True when the law changed.

    A change of K_coll in contact would inject 1/2 dK z^2. A set that would turn the stick's height into too much speed
    waits for a better moment, at the latest the next release.
    """
    block, motion, player, plan = servo.block, servo.motion[0], servo.player[0], servo.plan[0]
    if triple.has_fresh(block.wanted_cells):
        player.holding = 1
    if player.holding == 0:
        return False
    wanted = block.wanted[triple.take(block.wanted_cells, block.wanted)]
    if not fits(wanted.law, plan):
        player.holding = 0
        player.refused += 1
        player.refused_revision = wanted.revision
        return False
    left = composition.left_at_most(servo.law[0], motion)
    if not envelope.safe_from(wanted.law, motion.z, motion.v, left, plan.max_force_N, plan.max_speed_m_per_s):
        return False
    player.holding = 0
    composition.keep_speed(servo.law[0], wanted.law, motion)
    servo.law[0] = wanted.law
    player.revision = wanted.revision
    triple.publish(block.live_cells, block.live, wanted)
    return True
