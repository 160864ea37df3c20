"""One tick of the simulated stick: latch parameters, advance the physics, note strikes, tell how it stands.

Tick thread: no allocation, no locks, no Python, no exceptions. The same text runs in real time and in virtual time.
"""

import math

from drumstick import contact, envelope, exact
from drumstick.effects import pulse
from haptic_server.block import ARM, HEARTBEAT, HELD, PANIC, PANICS_SEEN, Block
from haptic_server.records import FAULT, NOT_A_NUMBER, PLAYING, READY, RELEASE, STRIKE
from haptic_server.records import PANIC as STATUS_PANIC
from realtime import ring, triple
from realtime.atomics import exchange, load_acquire, store_release
from realtime.jit import Record, njit

_EVENTS_IN_A_TICK = (
    64  # more is a stick buzzing faster than anything audible: the rest waits for the next tick
)
_STILL_M_PER_S = 1e-3
_STILL_PLAYING_NS = 2_000_000_000


@njit()
def _latch(block: Block, law: Record, motion: Record, player: Record, plan: Record) -> None:
    # A set takes effect whole, at z >= 0 above the head: a change of K_coll in contact would inject 1/2 dK z^2. One
    # that would turn the stick's height into too much speed waits for a better moment, at the latest the next release.
    if triple.has_fresh(block.wanted_cells):
        player.holding = 1
    if player.holding == 0:
        return
    wanted = block.wanted[triple.take(block.wanted_cells, block.wanted)]
    if envelope.check(wanted.law, plan.max_force_N, plan.max_speed_m_per_s) != envelope.OK:
        player.holding = 0
        player.refused += 1
        player.refused_revision = wanted.revision
        return
    left = abs(pulse.left(law[0], motion))
    if not envelope.safe_from(wanted.law, motion.z, motion.v, left, plan.max_force_N, plan.max_speed_m_per_s):
        return
    player.holding = 0
    pulse.keep_speed(law[0], wanted.law, motion)
    law[0] = wanted.law
    player.revision = wanted.revision
    triple.publish(block.live_cells, block.live, wanted)


@njit()
def _note_strike(
    block: Block, law: Record, motion: Record, player: Record, plan: Record, event: Record, t_ns: int
):
    speed = -motion.v_in
    player.seq += 1
    first, second = player.before_last_ns, player.last_ns
    player.roll_rate_Hz = 0.0
    if second > 0 and t_ns > second:
        # Over two intervals when both are recent: a roll of period two shows its mean rate.
        both = first > 0 and t_ns - first < _STILL_PLAYING_NS
        player.roll_rate_Hz = 2e9 / (t_ns - first) if both else 1e9 / (t_ns - second)
    player.before_last_ns = second
    player.last_ns = t_ns
    event.kind = STRIKE
    event.seq = player.seq
    event.t_ns = t_ns
    event.x = player.x
    event.y = player.y
    event.a = speed
    event.b = contact.peak_force(law.m, law.k_coll, law.r_in, speed)
    event.c = contact.contact_time(law.release, law.m, law.k_coll, law.r_in)
    event.level = min(speed / plan.full_scale_m_per_s, 1.0)
    event.peak_N = 0.0
    ring.push(block.ring_cells, block.events, event)


@njit()
def _note_release(block: Block, law: Record, motion: Record, player: Record, event: Record, t_ns: int):
    player.v_e_m_per_s = motion.v_out + pulse.left(law, motion)
    event.kind = RELEASE
    event.seq = player.seq
    event.t_ns = t_ns
    event.a = motion.v_out
    event.b = motion.impulse_N_s
    event.c = motion.contact_s
    event.level = 0.0
    event.peak_N = motion.peak_N
    ring.push(block.ring_cells, block.events, event)


@njit()
def _end_contact(
    block: Block, law: Record, motion: Record, player: Record, event: Record, now_ns: int
) -> None:
    # Whoever takes the stick out of the head ends its contact: no note may hang.
    if motion.place != exact.ABOVE:
        motion.v_out = 0.0
        motion.z = 0.0
        if not (abs(motion.impulse_N_s) < 1e6 and motion.contact_s < 1e6 and motion.peak_N < 1e6):
            motion.impulse_N_s = motion.contact_s = motion.peak_N = 0.0  # a fault's numbers go nowhere
        motion.place = exact.ABOVE
        _note_release(block, law, motion, player, event, now_ns)


@njit()
def _lift_away(block: Block, law: Record, motion: Record, player: Record, event: Record, now_ns: int) -> None:
    # Panic on the simulated stick: no force acts on it and it touches nothing.
    pulse.stop(law, motion)
    _end_contact(block, law, motion, player, event, now_ns)
    motion.v = 0.0
    motion.fate = exact.LEFT


@njit()
def _advance(
    block: Block,
    law: Record,
    motion: Record,
    player: Record,
    plan: Record,
    event: Record,
    now_ns: int,
    span_s: float,
) -> None:
    moved = 0.0
    for _ in range(_EVENTS_IN_A_TICK):
        what, duration = exact.advance(law[0], motion, span_s - moved)
        moved += duration
        t_ns = now_ns - int((span_s - moved) * 1e9)
        if what == exact.ENTRY:
            _note_strike(block, law[0], motion, player, plan, event, t_ns)
        elif what == exact.RELEASE:
            _note_release(block, law[0], motion, player, event, t_ns)
            _latch(
                block, law, motion, player, plan
            )  # at z = 0, going up: a buzz may never be seen above the head
        elif what == exact.HORIZON:
            return
    # A stick that buzzes faster than anything audible would take the tick over: the player takes it off the head.
    _lift_away(block, law[0], motion, player, event, now_ns)


@njit()
def _watch_still(motion: Record, player: Record, plan: Record, span_s: float) -> None:
    # A stick that creeps in the head, by whatever law, is dead too; and one that has flown so high that a waiting set
    # cannot take over safely is fetched.
    creeping = motion.place != exact.ABOVE and abs(motion.v) <= _STILL_M_PER_S
    too_high = motion.place == exact.ABOVE and player.holding != 0
    if not (creeping or too_high):
        player.still_s = 0.0
        return
    player.still_s += span_s
    if player.still_s >= plan.rest_s:
        player.still_s = 0.0
        player.rest_s = plan.rest_s if too_high else 0.0
        motion.fate = exact.CAPTURED


@njit()
def _rest(
    block: Block,
    law: Record,
    motion: Record,
    player: Record,
    plan: Record,
    event: Record,
    now_ns: int,
    span_s: float,
) -> None:
    # A stick that lies dead in the head, or has left for good, is thrown again after a while, as `simulate` starts.
    player.rest_s += span_s
    if player.rest_s < plan.rest_s:
        return
    player.rest_s = 0.0
    _lift_away(block, law[0], motion, player, event, now_ns)
    motion.z = 0.0
    motion.v = plan.throw_m_per_s
    motion.fate = exact.MOVING
    _latch(block, law, motion, player, plan)


@njit()
def _orders(
    block: Block, law: Record, motion: Record, player: Record, plan: Record, event: Record, now_ns: int
) -> None:
    panics = load_acquire(
        block.control, PANIC
    )  # a count: a panic that comes after an arm is never lost to it
    if panics != player.panics_seen:
        player.panics_seen = panics
        player.panicked = 1
        exchange(block.control, ARM, 0)  # both in one tick: panic wins, arm again
        _lift_away(block, law, motion, player, event, now_ns)
    elif exchange(block.control, ARM, 0) != 0:
        player.panicked = 0
        player.fault = 0
        player.rest_s = plan.rest_s  # thrown on this very tick
        _lift_away(block, law, motion, player, event, now_ns)


@njit()
def tick(
    block: Block,
    law: Record,
    motion: Record,
    player: Record,
    plan: Record,
    event: Record,
    now_ns: int,
    span_s: float,
) -> None:
    """Advance to `now_ns` over the `span_s` seconds before it. law: array (1,); the rest are records of one."""
    _orders(block, law[0], motion, player, plan, event, now_ns)
    player.phase += 2.0 * math.pi * span_s / plan.orbit_period_s
    if player.phase > math.pi:
        player.phase -= 2.0 * math.pi
    player.x = plan.orbit_radius * math.cos(player.phase)
    player.y = plan.orbit_radius * math.sin(player.phase)
    if player.panicked != 0 or player.fault != 0:
        _latch(block, law, motion, player, plan)
    else:
        if motion.fate != exact.MOVING:
            _rest(block, law, motion, player, plan, event, now_ns, span_s)
        elif motion.z > 0.0:
            _latch(block, law, motion, player, plan)
        if motion.fate != exact.LEFT:
            _advance(block, law, motion, player, plan, event, now_ns, span_s)
            _watch_still(motion, player, plan, span_s)
        if not (abs(motion.z) < 1e3 and abs(motion.v) < 1e3):
            player.fault = NOT_A_NUMBER
            motion.z = 0.0
            _lift_away(block, law[0], motion, player, event, now_ns)
    store_release(block.control, HELD, 1 if player.panicked != 0 or player.fault != 0 else 0)
    store_release(block.control, PANICS_SEEN, player.panics_seen)
    store_release(block.control, HEARTBEAT, now_ns)


@njit()
def tell(block: Block, law: Record, motion: Record, player: Record, status: Record, now_ns: int) -> None:
    """Publish how the servo stands after a tick; the caller has filled tick, overruns and lateness."""
    in_contact = motion.place == exact.CONTACT and motion.fate != exact.LEFT
    since_strike = now_ns - player.last_ns
    status.t_ns = now_ns
    status.status = READY
    if player.last_ns > 0 and since_strike < _STILL_PLAYING_NS:
        status.status = PLAYING
    if player.panicked != 0:
        status.status = STATUS_PANIC
    if player.fault != 0:
        status.status = FAULT
    status.fault = player.fault
    status.z_m = motion.z
    status.v_m_per_s = motion.v
    status.force_N = (
        contact.force(law.k_coll, law.r_in - law.r_out, motion.z, motion.v) if in_contact else 0.0
    )
    status.x = player.x
    status.y = player.y
    status.roll_rate_Hz = player.roll_rate_Hz if status.status == PLAYING else 0.0
    status.v_e_m_per_s = player.v_e_m_per_s
    status.strikes = player.seq
    status.revision = player.revision
    status.refused = player.refused
    status.refused_revision = player.refused_revision
    triple.publish(block.status_cells, block.status, status)
