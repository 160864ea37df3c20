"""The hand that follows a pointer: within its travel, no faster than it may, and up again when nobody points.

What a pointer asks for comes over a network, 60 times a second at best. So here it is cut to what a hand does: a wish
that moves at most so fast, through a critically damped filter, whose answer to no input is ever faster than the input
or outside of it. Tick thread: no allocation, no locks, no Python, no exceptions.
"""

import math

from haptic_server.block import Block
from realtime import triple_buffer
from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of

STALE_NS = (
    400_000_000  # a pointer not heard for so long has let go; a busy browser skips a quarter of a second
)
SMOOTH_S = 0.008  # half a frame of 60 Hz: the steps between frames become one movement
LIFTED_M = 0.02  # a lifted hand is at least so far above the head, wherever z_ss is
ACROSS_PER_S = 10.0  # radii that it may cross in a second
_MIN_TRAVEL_M = 1e-6


class PointedHand(Record):
    """lift: 0 where the hand presses (z_ss) .. 1 where it is lifted; x, y in radii. `wish` has the speed limit, `lift`
    and `lift_per_s` are the filter's. stands_m: where it holds the exact stick now. height_m and fastest_m_per_s do
    not change.
    """

    wish: float
    lift: float
    lift_per_s: float
    x: float
    y: float
    height_m: float
    stands_m: float
    fastest_m_per_s: float


HAND = dtype_of(PointedHand)


@njit()
def top_of(hand: PointedHand, rest_m: float) -> float:
    """Height of the lifted hand above the head, m, when it presses at `rest_m`."""
    return max(rest_m + hand.height_m, LIFTED_M)


@njit()
def height_of(hand: PointedHand, rest_m: float) -> float:
    """Height at which the hand holds its spring now, m above the head."""
    return rest_m + hand.lift * (top_of(hand, rest_m) - rest_m)


@njit()
def _towards(present: float, wanted: float, most: float) -> float:
    # Compared so that a NaN moves nothing.
    if not -1.0 <= wanted <= 1.0:
        return present
    return present + min(max(wanted - present, -most), most)


@njit()
def follow(hand: PointedHand, block: Block, rest_m: float, now_ns: int, span_s: float) -> None:
    """Move the hand on by `span_s` to where the newest pointer wants it; it trusts nothing that stands there."""
    pointer = block.pointer[triple_buffer.take(block.pointer_cells)]
    wanted = 1.0
    if pointer.held != 0 and abs(now_ns - pointer.t_ns) <= STALE_NS and 0.0 <= pointer.lift <= 1.0:
        wanted = pointer.lift
        hand.x = _towards(hand.x, pointer.x, ACROSS_PER_S * span_s)
        hand.y = _towards(hand.y, pointer.y, ACROSS_PER_S * span_s)
    travel_m = max(top_of(hand, rest_m) - rest_m, _MIN_TRAVEL_M)
    hand.wish = _towards(hand.wish, wanted, hand.fastest_m_per_s / travel_m * span_s)
    # e'' + 2 w e' + w^2 e = 0, solved over the span: stable for any.
    w = 1.0 / SMOOTH_S
    off = hand.lift - hand.wish
    slope = hand.lift_per_s + w * off
    fade = math.exp(-w * span_s)
    hand.lift = hand.wish + (off + slope * span_s) * fade
    hand.lift_per_s = (hand.lift_per_s - w * slope * span_s) * fade
