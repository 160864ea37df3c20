"""The contact's force, tick by tick, for a drum that is excited by it; a scene that does not stream has none of this.

Each sample is the mean over one tick: what the contact's impulse grew by, over T. So the samples of a contact times T
add up to the impulse that its release tells, for the exact stick too, whose contacts begin and end inside ticks. An
exact tick covers the time before it, a held force (a sampled arm) the time after. Behind a contact comes one 0 N. A
contact is where it began: a force that stepped from junction to junction under way would click.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

from drumstick.stick.motion import exact
from haptic_server.contacts import LISTENED
from haptic_server.servo.force.memory import Servo
from realtime import ring
from realtime.atomics import load_acquire
from realtime.kernels.jit import njit, only_with

_MAX_TICKS = 20  # a longer gap is a stall, over which the stick has stood still
_MAX_N = 1e9


@njit()
def _push(servo: Servo, back: int, force_N: float) -> None:
    # The sample of the tick so many before the present one.
    stream, tick_state = servo.stream, servo.tick_state[0]
    if load_acquire(stream.contacts.cells, LISTENED) == 0:
        return
    state, sample = stream.state[0], stream.sample[0]
    sample.seq = tick_state.seq
    sample.tick = state.tick - back
    sample.t_ns = state.t_ns - back * servo.plan[0].period_ns
    sample.force_N = force_N if abs(force_N) < _MAX_N else 0.0
    ring.push(stream.contacts.cells, stream.contacts.slots, sample)


@njit()
def _grown(servo: Servo) -> None:
    # What the contact's impulse grew by since the last sample, evenly over the ticks that this one stands for.
    state, impulse_N_s = servo.stream.state[0], servo.motion[0].impulse_N_s
    ticks = state.missed + 1
    force_N = (impulse_N_s - state.streamed_N_s) * 1e9 / (ticks * servo.plan[0].period_ns)
    for k in range(ticks):
        _push(servo, ticks - 1 - k, force_N)
    state.streamed_N_s = impulse_N_s
    state.last_N = force_N


@njit()
def _count(servo: Servo, t_ns: int) -> int:
    # The next tick, which begins about t_ns; returns how many were left out before it. A device whose own clock is
    # quicker or slower than ours moves the ticks' times, not their numbers.
    state, period_ns = servo.stream.state[0], servo.plan[0].period_ns
    state.tick += 1
    due_ns = state.t_ns + period_ns
    missed = max((t_ns - due_ns) // period_ns, 0) if state.t_ns != 0 else 0
    state.tick += missed
    state.t_ns = due_ns + missed * period_ns
    if not abs(state.t_ns - t_ns) < period_ns:
        state.t_ns = t_ns
    return missed


@only_with("stream")
def exact_tick(servo: Servo, now_ns: int) -> None:
    """A tick of the exact stick begins to be computed: of the time up to now."""
    missed = _count(servo, now_ns - servo.plan[0].period_ns)
    servo.stream.state[0].missed = min(missed, _MAX_TICKS - 1)


@only_with("stream")
def held_tick(servo: Servo, now_ns: int) -> None:
    """A tick of a device that holds its force until the next: also over the ticks that were left out."""
    missed = _count(servo, now_ns)
    state = servo.stream.state[0]
    if state.inside != 0:
        for k in range(max(missed - _MAX_TICKS, 0), missed):
            _push(servo, missed - k, state.last_N)


@only_with("stream")
def begin(servo: Servo) -> None:
    """A contact begins in this tick; its strike has been counted."""
    state, sample = servo.stream.state[0], servo.stream.sample[0]
    sample.x = servo.tick_state[0].x
    sample.y = servo.tick_state[0].y
    state.inside = 1
    state.streamed_N_s = 0.0
    state.last_N = 0.0


@only_with("stream")
def end(servo: Servo) -> None:
    """Put the last sample of a contact that ends in this tick, and the 0 N that closes it."""
    state = servo.stream.state[0]
    if state.inside != 0:
        _grown(servo)
        _push(servo, -1, 0.0)
        state.inside = 0


@only_with("stream")
def forget(servo: Servo) -> None:
    """The contact's record was wiped by a fault: nothing more of it is streamed."""
    servo.stream.state[0].streamed_N_s = servo.motion[0].impulse_N_s


@only_with("stream")
def settle(servo: Servo) -> None:
    """The tick is over: tell its force, if the stick is in the head."""
    if servo.stream.state[0].inside != 0 and servo.motion[0].contact_phase != exact.ABOVE:
        _grown(servo)
