"""The mesh one step on, a strip of rows at a time, as explicit vector code: the innermost loop of all that sounds.

A junction sees its neighbours in u:

    sum       over the neighbours of u: `neighbour_sum`    (six on the triangular mesh, four on the square one)
    plain     u+ = w (g sum + f) + u_gain u - u_old_gain u-
    momentum  a  = w sum - u_gain u;   p' = rho p + g a + w f;   u+ = u + p' + eta a
    fourth    the same of A u, and u itself is `extra`: plain, with extra_gain u added; or with momentum
              a  = w g sum + u_gain A u;   p' = rho p + a + extra_gain A u + w f;   u+ = u + p' + eta a

w is `weights`, u- what `u_old` held, u+ what it holds afterwards, p the junctions' momentum. None is not computed.
Compilers find vectors here only while nothing stands beside the sum, and then load each neighbour anew; so this is
written in the compiler's own language. How a strip is walked along stands in membrane.strip.

Any thread; no allocation, no branch but the loops'. Vectors are as wide as the processor's; rows start on multiples of
16 lanes of arrays that are aligned to 64 bytes.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from drumstick.drum.membrane.simd import FLOAT, Lanes
from drumstick.drum.membrane.strip import Strip, walk
from drumstick.drum.membrane.terms import Terms


class _Given:
    # The arguments of an intrinsic: pointers of arrays and vectors of gains; None for what is absent.
    def __init__(self, lanes, context, builder, signature, args) -> None:
        self._lanes = lanes
        self._context = context
        self._builder = builder
        self._kinds = signature.args
        self._args = args

    def array(self, at):
        return self._pointer(self._kinds[at], self._args[at])

    def _pointer(self, kind, value):
        return self._context.make_array(kind)(self._context, self._builder, value).data

    def _parts(self, at):
        kinds = self._kinds[at].types
        return [(kind, self._builder.extract_value(self._args[at], k)) for k, kind in enumerate(kinds)]

    def terms(self, at) -> Terms:
        return Terms(*(self._term(kind, value) for kind, value in self._parts(at)))

    def _term(self, kind, value):
        if isinstance(kind, types.NoneType):
            return None
        if isinstance(kind, types.Array):
            return self._pointer(kind, value)
        return self._lanes.everywhere(self._context.cast(self._builder, value, kind, types.float32))

    def strip(self, weights, bounds, side: int) -> Strip:
        # `u` is the first argument.
        bounds = (
            self._context.cast(self._builder, value, kind, types.int64) for kind, value in self._parts(bounds)
        )
        return Strip(self.array(0), self.array(weights), *bounds, side)


def _plain(lanes, step: Terms, u_old, i, centre, neighbour_sum, weight):
    if step.neighbour_gain is not None:
        neighbour_sum = lanes.times(step.neighbour_gain, neighbour_sum)
    if step.push is not None:
        neighbour_sum = lanes.plus(neighbour_sum, step.push)
    coming = lanes.sum_with_product(weight, neighbour_sum, lanes.times(step.u_gain, centre))
    if step.extra is not None:
        coming = lanes.sum_with_product(step.extra_gain, lanes.load(step.extra, i), coming)
    # u- last: rounded with it before, smooth waves lose a hundred times as much to rounding, always in one sense.
    return lanes.sum_with_product(lanes.negative(step.u_old_gain), lanes.load(u_old, i), coming)


def _with_momentum(lanes, step: Terms, u_old, i, centre, neighbour_sum, weight):
    pulled = lanes.sum_with_product(weight, neighbour_sum, lanes.negative(lanes.times(step.u_gain, centre)))
    driven = pulled if step.neighbour_gain is None else lanes.times(step.neighbour_gain, pulled)
    if step.push is not None:
        driven = lanes.sum_with_product(weight, step.push, driven)
    moving = lanes.sum_with_product(step.rho, lanes.load(step.momentum, i), driven)
    lanes.store(moving, step.momentum, i)
    return lanes.plus(centre, lanes.sum_with_product(step.eta, pulled, moving))


def _fourth_with_momentum(lanes, step: Terms, u_old, i, centre, neighbour_sum, weight):
    neighbour_sum = lanes.times(step.neighbour_gain, neighbour_sum)
    pulled = lanes.sum_with_product(weight, neighbour_sum, lanes.times(step.u_gain, centre))
    driven = lanes.sum_with_product(step.extra_gain, centre, pulled)
    if step.push is not None:
        driven = lanes.sum_with_product(weight, step.push, driven)
    moving = lanes.sum_with_product(step.rho, lanes.load(step.momentum, i), driven)
    lanes.store(moving, step.momentum, i)
    return lanes.plus(lanes.load(step.extra, i), lanes.sum_with_product(step.eta, pulled, moving))


def _form(step: Terms):
    if step.momentum is None:
        return _plain
    return _with_momentum if step.extra is None else _fourth_with_momentum


def step_of(width: int, side: int) -> Any:
    """The intrinsic that takes a strip a step on, `width` lanes at a time; for compiled code.

    step(u, u_old, weights, bounds, terms) -> float32: the sum of the strip's u+ when `terms.total` is not None, else 0.
    Arrays float32, shape (J,); `bounds`: StripBounds, `terms`: Terms; `side` is the first row's.
    """

    @intrinsic
    def step(typingctx, u, u_old, weights, bounds, terms):
        def codegen(context, builder, signature, args):
            lanes = Lanes(builder, width)
            given = _Given(lanes, context, builder, signature, args)
            step, u_old = given.terms(4), given.array(1)
            form = _form(step)
            summed = 0 if step.total is None else 1

            def turn(i, centre, neighbour_sum, weight, so_far):
                result = form(lanes, step, u_old, i, centre, neighbour_sum, weight)
                lanes.store(result, u_old, i)
                return [lanes.plus(so_far[0], result)] if summed else []

            sums = walk(lanes, given.strip(2, 3, side), summed, turn)
            return lanes.sum(sums[0]) if summed else ir.Constant(FLOAT, 0.0)

        return types.float32(u, u_old, weights, bounds, terms), codegen

    return step


def stretch_of(width: int, side: int) -> Any:
    """The intrinsic for what a pitch glide must know of a strip: how it is stretched, how fast; for compiled code.

    stretch(u, u_old, weights, share, bounds, terms) -> (P, Q, R, T), float32. With d = w sum - u_gain u: P = sum
    share d x, Q = sum share d d, R = sum share d w and T = sum share d u-, where x = u - u-, and with momentum + rho p.
    In the fourth order d is the swept A u itself, u is `extra`, and x has w g sum + u_gain A u besides.
    """

    @intrinsic
    def stretch(typingctx, u, u_old, weights, share, bounds, terms):
        signature = types.UniTuple(types.float32, 4)(u, u_old, weights, share, bounds, terms)

        def codegen(context, builder, signature, args):
            lanes = Lanes(builder, width)
            given = _Given(lanes, context, builder, signature, args)
            u_old_p, share_p, step = given.array(1), given.array(3), given.terms(5)

            def turn(i, centre, neighbour_sum, weight, so_far):
                gone = lanes.load(u_old_p, i)
                if step.extra is None:
                    pulled = lanes.sum_with_product(
                        weight, neighbour_sum, lanes.negative(lanes.times(step.u_gain, centre))
                    )
                    moved = lanes.minus(centre, gone)
                else:
                    pulled = centre
                    again = lanes.times(step.neighbour_gain, neighbour_sum)
                    again = lanes.sum_with_product(weight, again, lanes.times(step.u_gain, centre))
                    moved = lanes.plus(lanes.minus(lanes.load(step.extra, i), gone), again)
                weighed = lanes.times(lanes.load(share_p, i), pulled)
                if step.momentum is not None:
                    moved = lanes.sum_with_product(step.rho, lanes.load(step.momentum, i), moved)
                factors = (moved, pulled, weight, gone)
                return [
                    lanes.sum_with_product(weighed, factor, sum_)
                    for sum_, factor in zip(so_far, factors, strict=True)
                ]

            sums = walk(lanes, given.strip(2, 4, side), 4, turn)
            return context.make_tuple(builder, signature.return_type, [lanes.sum(s) for s in sums])

        return signature, codegen

    return stretch
