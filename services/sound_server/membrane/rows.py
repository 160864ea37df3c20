"""One row of the mesh, one step on, as explicit vector code: the innermost loop of everything that sounds.

A row of junctions, start <= i < stop in flat indices, sees its neighbours in the plane `now`:

    ring  = sum over the neighbours of u                       (six on the triangular mesh, four on the square one)
    plain     u+ = w (g ring + f) + now_gain u - then_gain u-
    momentum  a  = w ring - now_gain u;   p' = rho p + g a + w f;   u+ = u + p' + eta a
    fourth    as plain, with the ring and the first u taken from A u, and u itself added with a gain of its own

w is `weights`, u- what `then` held, u+ what it holds afterwards, p the junctions' momentum. None is not computed.
Compilers find vectors here only while nothing stands beside the sum, and then load each neighbour anew; so this loop
is written in the compiler's own language: neighbours in a row come from vectors that are there already, shifted.

Any thread; no allocation, no branch but the loop's. Vectors are as wide as the processor's; rows start on multiples of
16 lanes of arrays that are aligned to 64 bytes, and a vector around a row belongs to the same array.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from sound_server.membrane.lanes import FLOAT, WORD, Lanes

# side: 0 for the square mesh; -1 or 1 where the nearer column of the rows beside lies to the left or right.
LEVEL, LEFT, RIGHT = 0, -1, 1
# Turns (i, centre, ring, sums so far) into the sums after it.
_Turn = Callable[[Any, Any, Any, list[Any]], list[Any]]


def _first_vectors(lanes, now, stride, start, side):
    builder, width = lanes.builder, ir.Constant(WORD, lanes.width)
    above, below = builder.sub(start, stride), builder.add(start, stride)
    first = [lanes.load(now, builder.sub(start, width)), lanes.load(now, start)]
    if side == LEFT:
        above, below = builder.sub(above, width), builder.sub(below, width)
    return first if side == LEVEL else [*first, lanes.load(now, above), lanes.load(now, below)]


def _neighbours(lanes, now, stride, i, side, beside):
    # Pairs of neighbours in the rows above and below, and the vectors that the next turn takes over.
    builder = lanes.builder
    above, below = builder.sub(i, stride), builder.add(i, stride)
    if side == RIGHT:
        width = ir.Constant(WORD, lanes.width)
        above, below = builder.add(above, width), builder.add(below, width)
    fresh = [lanes.load(now, above), lanes.load(now, below)]
    if side == LEVEL:
        return [tuple(fresh)], []
    if side == RIGHT:
        return [(old, lanes.after(old, new)) for old, new in zip(beside, fresh, strict=True)], fresh
    return [(new, lanes.before(old, new)) for old, new in zip(beside, fresh, strict=True)], fresh


def _loop(lanes, now, stride, start, stop, side, sums: int, turn: _Turn):
    # Emit the loop over a row; returns its sums.
    builder = lanes.builder
    entry, first = builder.block, _first_vectors(lanes, now, stride, start, side)
    given = [start, *first, *[lanes.zero] * sums]
    head, body, end = (builder.append_basic_block(name) for name in ("row", "vector", "after"))
    builder.branch(head)
    builder.position_at_end(head)
    nodes = [builder.phi(value.type) for value in given]
    for node, value in zip(nodes, given, strict=True):
        node.add_incoming(value, entry)
    i, last, centre = nodes[:3]
    beside, so_far = nodes[3 : len(nodes) - sums], nodes[len(nodes) - sums :]
    builder.cbranch(builder.icmp_signed("<", i, stop), body, end)

    builder.position_at_end(body)
    onward = builder.add(i, ir.Constant(WORD, lanes.width))
    coming = lanes.load(now, onward)
    others, kept = _neighbours(lanes, now, stride, i, side, beside)
    pairs = [lanes.plus(lanes.before(last, centre), lanes.after(centre, coming))]
    pairs += [lanes.plus(a, b) for a, b in others]
    ring = lanes.plus(pairs[0], pairs[1])
    if len(pairs) > 2:
        ring = lanes.plus(ring, pairs[2])
    after = turn(i, centre, ring, so_far)
    builder.branch(head)
    for node, value in zip(nodes, [onward, centre, coming, *kept, *after], strict=True):
        node.add_incoming(value, builder.block)
    builder.position_at_end(end)
    return so_far


class _Given:
    # The arguments of an intrinsic: pointers of arrays and vectors of gains; None for what is absent.
    def __init__(self, lanes, context, builder, signature, args) -> None:
        self._lanes = lanes
        self._context = context
        self._builder = builder
        self._kinds = signature.args
        self._args = args

    def array(self, at):
        kind = self._kinds[at]
        if _is_absent(kind):
            return None
        return self._context.make_array(kind)(self._context, self._builder, self._args[at]).data

    def gain(self, at):
        return None if _is_absent(self._kinds[at]) else self._lanes.everywhere(self._args[at])


def _is_absent(kind) -> bool:
    return isinstance(kind, types.NoneType | types.Omitted)


def _float(kind):
    return kind if _is_absent(kind) else types.float32


class _Step(NamedTuple):
    # What a step works on; optional things are None.
    then: Any
    weights: Any
    now_gain: Any
    then_gain: Any
    ring_gain: Any
    push: Any
    momentum: Any
    kept: Any
    brake: Any
    plane: Any
    plane_gain: Any


def _plain(lanes, step: _Step, i, centre, ring):
    if step.ring_gain is not None:
        ring = lanes.times(step.ring_gain, ring)
    if step.push is not None:
        ring = lanes.plus(ring, step.push)
    coming = lanes.plus(lanes.times(lanes.load(step.weights, i), ring), lanes.times(step.now_gain, centre))
    if step.plane is not None:
        coming = lanes.plus(coming, lanes.times(step.plane_gain, lanes.load(step.plane, i)))
    # u- last: rounded with it before, smooth waves lose a hundred times as much to rounding, always in one sense.
    return lanes.minus(coming, lanes.times(step.then_gain, lanes.load(step.then, i)))


def _with_momentum(lanes, step: _Step, i, centre, ring):
    weight = lanes.load(step.weights, i)
    pulled = lanes.minus(lanes.times(weight, ring), lanes.times(step.now_gain, centre))
    driven = pulled if step.ring_gain is None else lanes.times(step.ring_gain, pulled)
    if step.push is not None:
        driven = lanes.plus(lanes.times(weight, step.push), driven)
    moving = lanes.plus(lanes.times(step.kept, lanes.load(step.momentum, i)), driven)
    lanes.store(moving, step.momentum, i)
    return lanes.plus(centre, lanes.plus(lanes.times(step.brake, pulled), moving))


def step_of(width: int, side: int) -> Any:
    """The intrinsic that takes one row a step on, `width` lanes at a time; for compiled code.

    step(now, then, weights, start, stop, stride, now_gain, then_gain, ring_gain, push, momentum, kept, brake, plane,
    plane_gain, total) -> float32: the sum of the row's u+ when `total` is not None, else 0. Arrays float32, shape (J,).
    """

    @intrinsic
    def step(
        typingctx,
        now,
        then,
        weights,
        start,
        stop,
        stride,
        now_gain,
        then_gain,
        ring_gain,
        push,
        momentum,
        kept,
        brake,
        plane,
        plane_gain,
        total,
    ):
        gains = [_float(kind) for kind in (now_gain, then_gain, ring_gain, push)]
        places = (types.int64, types.int64, types.int64)
        optional = (momentum, _float(kept), _float(brake), plane, _float(plane_gain), total)
        signature = types.float32(now, then, weights, *places, *gains, *optional)

        def codegen(context, builder, signature, args):
            lanes = Lanes(builder, width)
            given = _Given(lanes, context, builder, signature, args)
            work = _Step(
                *(given.array(1), given.array(2), *(given.gain(at) for at in (6, 7, 8, 9))),
                *(given.array(10), given.gain(11), given.gain(12), given.array(13), given.gain(14)),
            )
            form = _plain if work.momentum is None else _with_momentum
            summed = 0 if _is_absent(signature.args[15]) else 1

            def turn(i, centre, ring, so_far):
                result = form(lanes, work, i, centre, ring)
                lanes.store(result, work.then, i)
                return [lanes.plus(so_far[0], result)] if summed else []

            sums = _loop(lanes, given.array(0), args[5], args[3], args[4], side, summed, turn)
            return lanes.sum(sums[0]) if summed else ir.Constant(FLOAT, 0.0)

        return signature, codegen

    return step


def stretch_of(width: int, side: int) -> Any:
    """The intrinsic for what a pitch glide must know of a row: how it is stretched, and how fast; for compiled code.

    stretch(now, then, weights, share, start, stop, stride, now_gain, momentum, kept) -> (P, Q, R, T), float32. With
    d = w ring - now_gain u: P = sum share d x, Q = sum share d d, R = sum share d w and T = sum share d u-, where
    x = u - u-, and with momentum + rho p.
    """

    @intrinsic
    def stretch(typingctx, now, then, weights, share, start, stop, stride, now_gain, momentum, kept):
        places = (types.int64, types.int64, types.int64)
        returned = types.UniTuple(types.float32, 4)
        signature = returned(now, then, weights, share, *places, types.float32, momentum, _float(kept))

        def codegen(context, builder, signature, args):
            lanes = Lanes(builder, width)
            given = _Given(lanes, context, builder, signature, args)
            then_p, weights_p, share_p = (given.array(at) for at in (1, 2, 3))
            own, momentum_p, rho = given.gain(7), given.array(8), given.gain(9)

            def turn(i, centre, ring, so_far):
                weight = lanes.load(weights_p, i)
                pulled = lanes.minus(lanes.times(weight, ring), lanes.times(own, centre))
                weighed = lanes.times(lanes.load(share_p, i), pulled)
                gone = lanes.load(then_p, i)
                moved = lanes.minus(centre, gone)
                if momentum_p is not None:
                    moved = lanes.plus(moved, lanes.times(rho, lanes.load(momentum_p, i)))
                return [
                    lanes.plus(so_far[0], lanes.times(weighed, moved)),
                    lanes.plus(so_far[1], lanes.times(weighed, pulled)),
                    lanes.plus(so_far[2], lanes.times(weighed, weight)),
                    lanes.plus(so_far[3], lanes.times(weighed, gone)),
                ]

            sums = _loop(lanes, given.array(0), args[6], args[4], args[5], side, 4, turn)
            return context.make_tuple(builder, signature.return_type, [lanes.sum(s) for s in sums])

        return signature, codegen

    return stretch
