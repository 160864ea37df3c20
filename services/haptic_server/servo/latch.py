"""When a set of parameters takes effect: whole, above the head, inside the envelope, without throwing the stick.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from drumstick import composition, envelope
from haptic_server.servo.fence import within
from haptic_server.servo.memory import Servo
from realtime import triple
from realtime.jit import Record, njit


@njit()
def fits(law: Record, plan: Record) -> bool:
    """Is this law inside the envelope of scene and device?"""
    if envelope.check(law, plan.max_force_N, plan.max_speed_m_per_s) != envelope.OK:
        return False
    return envelope.check_sampled(law, plan.stiffness_N_per_m, plan.lag_s, 0.0) == envelope.OK


@njit()
def passes(servo: Servo) -> bool:
    """Is the law in servo.offer one that its scene could have, and safe? The servo's own fence: it trusts nobody."""
    if not within(servo.fence, servo.offer_words, servo.offer_numbers):
        return False
    return fits(servo.offer[0].law, servo.plan[0])


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
    # A copy of our own: what was looked at is what is used, whoever else may write to the block.
    servo.offer[0] = block.wanted[triple.take(block.wanted_cells, block.wanted)]
    wanted = servo.offer[0]
    if not passes(servo):
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
