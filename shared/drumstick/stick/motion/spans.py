"""Time spans in which z' and the rate of the head's force each have at most one zero: signs at the ends miss no event.

Both obey the equation of motion without its constant. While no pulse runs, such a function's derivative is a free
motion, whose zeros are known in closed form, and between two of them the function vanishes at most once. While a pulse
fades as exp(-lam t), u = f' + lam f is a free motion, and exp(lam t) f is monotone between two zeros of u (Rolle's
theorem). Two pulses take two such steps, and the zeros of the first are found as roots. So no graze and no quick
throw-back falls between two nodes, in any regime of damping, and a span lasts up to half an oscillation.

Kernels: any thread; no allocation, no exceptions.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from drumstick.stick.motion.crossing import Point, Weights, changes, root, weighted
from drumstick.stick.segment import Segment, fastest_pulse_rate, fastest_rate
from realtime.kernels.jit import njit, overload

SPEED: Weights = (0.0, 1.0, 0.0, 0.0, 0.0)

# A motion that has died away has only rounding left, whose signs say nothing: look at it before, again and again.
_DIES_AWAY_RAD = 4.0
_FARTHER = 4.0
# A stick on its way out of the head is out soon after -z/v, long before it turns: looking there saves finding the turn.
_OUT_BY = 2.0


class Nodes(NamedTuple):
    """Ends of the next spans, s: for z', for the head's force rate, for motion that dies away; half an oscillation."""

    speed: float
    head_force: float
    fading: float
    period: float


@njit()
def head_force_rate(seg: Segment) -> Weights:
    """The rate of the head's force."""
    return 0.0, -seg.k, -seg.r, 0.0, 0.0


@njit()
def first_zero(a: float, w2: float, y: float, rate: float) -> float:
    """The first zero after t = 0 of a free motion that starts with y and its rate; inf if there is none."""
    if y < 0.0:
        y, rate = -y, -rate
    discriminant = w2 - a * a
    if discriminant > 0.0:
        wd = math.sqrt(discriminant)
        if y == 0.0:
            return math.pi / wd if rate != 0.0 else math.inf
        return math.atan2(wd * y, -rate - a * y) / wd
    split = math.sqrt(-discriminant)
    straight = -y / (rate + (a + split) * y)  # exp(2 split t) = 1 + 2 split straight
    if not straight > 0.0:
        return math.inf
    return math.log1p(2.0 * split * straight) / (2.0 * split) if split > 1e-300 else straight


@njit()
def _faded(weights: Weights, lam: float) -> Weights:
    # f' + lam f, for an f without a third derivative.
    c, c1, c2, _, one = weights
    return lam * c, c + lam * c1, c1 + lam * c2, c2, lam * one


@njit()
def _fading(push: tuple[float, float]) -> float:
    # The rate at which a pulse fades; 0 when it does not run, for then nothing has to be taken out.
    p, lam = push
    return lam if p != 0.0 else 0.0


@njit()
def _node(seg: Segment, weights: Weights, lam: float, start: Point) -> float:
    f, f1, f2, _ = weighted(weights, start)
    return first_zero(seg.a, seg.w2, f1 + lam * f, f2 + lam * f1)


def _first_node(seg: Segment, weights: Weights, start: Point) -> float:
    raise TypeError("compiled code only")


@overload(_first_node)
def _first_node_for_each(seg: Any, weights: Any, start: Any) -> Callable[..., float]:
    def none(seg: Segment, weights: Weights, start: Point) -> float:
        return _node(seg, weights, 0.0, start)

    def one(seg: Segment, weights: Weights, start: Point) -> float:
        return _node(seg, weights, _fading(seg.pulses[0]), start)

    def two(seg: Segment, weights: Weights, start: Point) -> float:
        return _node(seg, _faded(weights, _fading(seg.pulses[0])), _fading(seg.pulses[1]), start)

    return (none, one, two)[_pulses_in(seg)]


@njit()
def is_brief(seg: Segment, duration: float) -> bool:
    """True when this is well under half an oscillation, with no pulse running: then it is one span, as most ticks
    are.
    """
    return (
        duration > 0.0
        and fastest_pulse_rate(seg) == 0.0
        and duration * fastest_rate(seg.a, seg.w2, 0.0) < 1.0
    )


@njit()
def first_nodes(seg: Segment, start: Point, in_head: bool) -> Nodes:
    """The nodes after the segment's start; the push matters only in the head."""
    discriminant = seg.w2 - seg.a * seg.a
    look = _DIES_AWAY_RAD / abs(fastest_rate(seg.a, seg.w2, 0.0))  # -0.0 would end the span before it begins
    if in_head and start.v > 0.0 and start.z < 0.0:
        look = min(look, _OUT_BY * -start.z / start.v)
    return Nodes(
        _first_node(seg, SPEED, start),
        _first_node(seg, head_force_rate(seg), start) if in_head else math.inf,
        look,
        math.pi / math.sqrt(discriminant) if discriminant > 0.0 else math.inf,
    )


@njit()
def nearest(nodes: Nodes) -> float:
    """The next node."""
    return min(nodes.speed, nodes.head_force, nodes.fading)


@njit()
def later(nodes: Nodes, t: float) -> Nodes:
    """The nodes that come after t, which is not beyond the nearest one."""
    return Nodes(
        nodes.speed + nodes.period if t >= nodes.speed else nodes.speed,
        nodes.head_force + nodes.period if t >= nodes.head_force else nodes.head_force,
        nodes.fading * _FARTHER if t >= nodes.fading else nodes.fading,
        nodes.period,
    )


@njit()
def _zero_or_end(seg: Segment, weights: Weights, here: Point, there: Point) -> Point:
    if changes(weighted(weights, here)[0], weighted(weights, there)[0]):
        return root(seg, weights, here, there)
    return there


def cut(seg: Segment, here: Point, there: Point) -> tuple[Point, ...]:
    """The ends of the spans between two nodes, in order: with two pulses there are up to three."""
    raise TypeError("compiled code only")


@overload(cut)
def _cut_for_each(seg: Any, here: Any, there: Any) -> Callable[..., tuple[Point, ...]]:
    def whole(seg: Segment, here: Point, there: Point) -> tuple[Point, ...]:
        return (there,)

    def parts(seg: Segment, here: Point, there: Point) -> tuple[Point, ...]:
        lam = _fading(seg.pulses[0])
        first = _zero_or_end(seg, _faded(SPEED, lam), here, there)
        second = _zero_or_end(seg, _faded(head_force_rate(seg), lam), here, there)
        return (first, second, there) if first.t <= second.t else (second, first, there)

    return parts if _pulses_in(seg) == 2 else whole


def _pulses_in(seg: Any) -> int:
    return len(seg.types[seg.fields.index("pulses")])
