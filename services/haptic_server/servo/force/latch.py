"""The latch: a set of parameters takes effect whole, above the head, inside the envelope, without throwing the stick.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from drumstick.safety import envelope
from drumstick.safety.fence import within
from drumstick.stick import composition
from haptic_server.servo.force.memory import Servo
from realtime import triple_buffer
from realtime.kernels.jit import njit


@njit()
def passes(servo: Servo) -> bool:
    """True when the law in servo.offer is one that its scene could have, and safe: the servo trusts nobody.

    Keeps what the judgement tells in servo.tick_state.
    """
    tick_state = servo.tick_state[0]
    if not within(servo.fence, servo.offer_words, servo.offer_numbers):
        return False
    judgement = envelope.judge(servo.offer[0].law, servo.limits[0], servo.room)
    tick_state.offer_reach = judgement.reach
    tick_state.offer_window = judgement.window
    return judgement.code == envelope.OK


@njit()
def _offered(servo: Servo) -> bool:
    # Does a set that passes wait in servo.offer? It is judged once, when it comes.
    block, tick_state = servo.block, servo.tick_state[0]
    if not triple_buffer.has_fresh(block.wanted_cells):
        return bool(tick_state.holding != 0)
    # A copy of our own: what was looked at is what is used, whoever else may write to the block.
    servo.offer[0] = block.wanted[triple_buffer.take(block.wanted_cells, block.wanted)]
    if passes(servo):
        tick_state.holding = 1
        return True
    tick_state.holding = 0
    tick_state.refused += 1
    tick_state.refused_revision = servo.offer[0].revision
    return False


@njit()
def _use(servo: Servo) -> None:
    block, tick_state, wanted = servo.block, servo.tick_state[0], servo.offer[0]
    tick_state.holding = 0
    tick_state.reach = tick_state.offer_reach
    servo.track[0].widest = tick_state.offer_window
    composition.keep_speed(servo.law[0], wanted.law, servo.motion[0])
    servo.law[0] = wanted.law
    tick_state.revision = wanted.revision
    triple_buffer.publish(block.live_cells, block.live, wanted)


@njit()
def latch_in_hand(servo: Servo) -> bool:
    """Take the newest set that waits; call it only at z >= 0. True when the law changed.

    For a stick that somebody holds: a change of K_coll in contact would inject 1/2 dK z^2. The speed of the next
    contact is the hand's own, whatever the set says of a hand, and the guard limits what the motors do about it.
    """
    if not _offered(servo):
        return False
    _use(servo)
    return True


@njit()
def latch(servo: Servo) -> None:
    """Like `latch_in_hand`, for a stick whose hand is the law's own spring.

    A set that would turn the stick's height into too much speed waits for a better moment, at the latest the next
    release.
    """
    if not _offered(servo):
        return
    motion = servo.motion[0]
    left = composition.most_remaining_speed(servo.law[0], motion)
    if envelope.entry_speed(servo.offer[0].law, motion.z, motion.v) + left <= servo.tick_state[0].offer_reach:
        _use(servo)
