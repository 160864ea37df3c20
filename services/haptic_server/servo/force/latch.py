"""The latch: a set of parameters takes effect whole, above the head, inside the envelope, without throwing the stick.

A set that changes only what is heard waits for nothing.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from drumstick.safety import envelope
from drumstick.safety.entry_speed import speed_ahead
from drumstick.safety.fence import is_only_heard, within
from drumstick.stick import composition
from haptic_server.servo.force import gestured_hand
from haptic_server.servo.force.memory import Servo
from realtime import triple_buffer
from realtime.kernels.jit import njit


@njit()
def passes(servo: Servo) -> bool:
    """True when the law in servo.pending_set is one that its scene could have, and safe: the servo trusts nobody.

    Keeps what the judgement tells in servo.tick_state.
    """
    tick_state = servo.tick_state[0]
    if not within(servo.fence, servo.pending_words, servo.pending_numbers):
        return False
    judgement = envelope.judge(servo.pending_set[0].law, servo.envelope_limits[0], servo.scratch)
    tick_state.pending_max_entry_speed = judgement.max_entry_speed
    tick_state.pending_window = judgement.window
    return judgement.code == envelope.OK and gestured_hand.passes_at_worst(servo)


@njit()
def _has_pending(servo: Servo) -> bool:
    # Does a set that passes wait in servo.pending_set? It is judged once, when it comes.
    block, tick_state = servo.block, servo.tick_state[0]
    if not triple_buffer.has_fresh(block.wanted_cells):
        return bool(tick_state.is_pending != 0)
    # A copy of our own: what was looked at is what is used, whoever else may write to the block.
    servo.pending_set[0] = block.wanted[triple_buffer.take(block.wanted_cells)]
    if passes(servo):
        tick_state.is_pending = 1
        return True
    tick_state.is_pending = 0
    tick_state.refused += 1
    tick_state.refused_revision = servo.pending_set[0].revision
    return False


@njit()
def _use(servo: Servo) -> None:
    block, tick_state, pending = servo.block, servo.tick_state[0], servo.pending_set[0]
    tick_state.is_pending = 0
    tick_state.max_entry_speed = tick_state.pending_max_entry_speed
    servo.track[0].widest = tick_state.pending_window
    composition.keep_speed(servo.law[0], pending.law, servo.motion[0])
    servo.law[0] = pending.law
    gestured_hand.take(servo)
    tick_state.revision = pending.revision
    triple_buffer.publish(block.live_cells, block.live, pending)


@njit()
def latch_in_hand(servo: Servo) -> bool:
    """Take the newest set that waits; call it only at z >= 0. True when the law changed.

    For a stick that somebody holds: a change of K_coll in contact would inject 1/2 dK z^2. The speed of the next
    contact is the hand's own, whatever the set says of a hand, and the guard limits what the motors do about it.
    """
    if not _has_pending(servo):
        return False
    _use(servo)
    return True


@njit()
def latch_heard(servo: Servo) -> None:
    """Take the newest set that waits if the stick does not feel it; call it anywhere."""
    if _has_pending(servo) and is_only_heard(servo.fence, servo.pending_words, servo.law_words):
        _use(servo)


@njit()
def latch(servo: Servo) -> None:
    """Like `latch_in_hand`, for a stick whose hand is the law's own spring.

    A set that would turn the stick's height into too much speed waits for a better moment, at the latest the next
    release.
    """
    if not _has_pending(servo):
        return
    motion, law = servo.motion[0], servo.pending_set[0].law
    left = composition.most_remaining_speed(servo.law[0], motion)
    z_ss = gestured_hand.pressing(servo) * law.z_ss if law.z_ss < 0.0 else law.z_ss
    if speed_ahead(law, motion, z_ss, left) <= servo.tick_state[0].pending_max_entry_speed:
        _use(servo)
