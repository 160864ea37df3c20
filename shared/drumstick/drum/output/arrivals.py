"""Sums of what the head sends to a microphone in one step, as explicit vector code: velocities, each by its two delays.

A vector of junctions in a row arrives within a few steps: three, as a rule. A junction that is late by a time between
two steps counts in both, and one of the two is even: so two vectors of weights hold all, one for a packet's first and
third step, one for its second and fourth. Weights are positive, so a sign can say which of the two: with a the sum of
|w| v and b that of w v, the first is (a + b)/2 and the third (a - b)/2.

Packets are VECTORS vectors of one delay, sums begin anew in each, and there is no branch but the loop's: the
processor works on several at once. Lanes are not added up here but when their time has come (`microphones`).

Audio thread; no allocation. The layout allocates.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.core.cgutils import for_range
from numba.extending import intrinsic

from drumstick.drum.membrane.simd import WORD, Lanes
from drumstick.drum.memory.microphones import VECTORS, Packets

STEPS = 4  # that a packet reaches; a vector that needs more is in several packets


class Sending(NamedTuple):
    """Packets begin .. stop - 1 into the line at `line`, of last + 1 steps (a power of 2), in step `now`; int64."""

    begin: int
    stop: int
    line: int
    last: int
    now: int


def packets_of(
    late: npt.NDArray[np.float64], nearness: npt.NDArray[np.float64], width: int
) -> tuple[Packets, int]:
    """Lay out one microphone's junctions, and the longest delay; `late` is in steps, `nearness` 0 where nobody is."""
    nearness = nearness.reshape(-1, width)
    vectors = np.flatnonzero(nearness.any(axis=1))
    given, late = nearness[vectors], late.reshape(-1, width)[vectors]
    whole = np.floor(late).astype(np.int64)
    first = np.where(given > 0.0, whole, np.iinfo(np.int64).max).min(axis=1)
    longest = np.where(given > 0.0, whole + 1, 0).max(axis=1)
    counts = (longest - first) // STEPS + 1
    of = np.repeat(np.arange(len(vectors)), counts)  # the vector of each entry
    delay = first[of] + STEPS * (np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts))
    # One more, of nobody, fills packets.
    weights = np.append(_weights((late[of] - delay[:, None]), given[of]), np.zeros((1, 2, width)), axis=0)
    places = np.append(width * vectors[of], 0)
    found = _grouped(delay)
    # Backwards: what the sweep computed last is still at hand.
    found = found[np.argsort(-places[found[:, 0]], kind="stable")]
    delays, places = delay[found[:, 0]].astype(np.int32), places[found.ravel()].astype(np.int32)
    return Packets(delays, places, weights[found.ravel()].astype(np.float32)), int(longest.max())


def _weights(late: npt.NDArray[np.float64], given: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    # Of entries (E, W), late by so many steps after their delay: (E, 2, W), halved, with the later step's sign.
    weights = np.zeros((len(late), 2, late.shape[1]))
    for step in range(STEPS):
        share = given * np.maximum(1.0 - np.abs(late - step), 0.0)
        weights[:, step % 2] += 0.5 * share if step < 2 else -0.5 * share
    return weights


def _grouped(delay: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    # Entries of one delay, VECTORS a row, filled up with -1.
    found: list[npt.NDArray[np.int64]] = []
    for each in np.unique(delay):
        mine = np.flatnonzero(delay == each)
        found.append(np.append(mine, np.full(-len(mine) % VECTORS, -1)))
    return np.concatenate(found).reshape(-1, VECTORS)


class _Source:
    # Pointers to what a packet is made of.
    def __init__(self, lanes: Lanes, u, u_new, packets: Packets) -> None:
        self._lanes = lanes
        self._builder = lanes.builder
        self._u = u
        self._u_new = u_new
        self._packets = packets

    def number(self, base, at):
        """One of the int32 at `base`, as an index."""
        return self._builder.sext(self._builder.load(self._builder.gep(base, [at])), WORD)

    def times(self, at, factor: int, more: int = 0):
        """at * factor + more."""
        builder = self._builder
        return builder.add(builder.mul(at, ir.Constant(WORD, factor)), ir.Constant(WORD, more))

    def sums(self, packet) -> list[Any]:
        """Vectors that the packet sends, one for each of its steps."""
        lanes = self._lanes
        plain, signed = [lanes.zero] * 2, [lanes.zero] * 2
        for number in range(VECTORS):
            at = self.times(packet, VECTORS, number)
            place = self.number(self._packets.places, at)
            moved = lanes.minus(lanes.load(self._u_new, place), lanes.load(self._u, place))
            for side in range(2):
                weight = lanes.load(
                    self._packets.weights, self.times(at, 2 * lanes.width, side * lanes.width)
                )
                plain[side] = lanes.sum_with_product(lanes.size(weight), moved, plain[side])
                signed[side] = lanes.sum_with_product(weight, moved, signed[side])
        pairs = list(zip(plain, signed, strict=True))
        return [lanes.plus(*pair) for pair in pairs] + [lanes.minus(*pair) for pair in pairs]


def send_of(width: int) -> Any:
    """The intrinsic that sends packets off, `width` lanes at a time; for compiled code.

    send(u, u_new, packets, line, sending): adds to line, float32 of shape (steps, W), what will arrive in each step.
    """

    @intrinsic
    def send(typingctx, u, u_new, packets, line, sending):
        def codegen(context, builder, signature, args):
            def pointer(kind, value):
                return context.make_array(kind)(context, builder, value).data

            def parts(at):
                return [
                    (kind, builder.extract_value(args[at], k))
                    for k, kind in enumerate(signature.args[at].types)
                ]

            lanes = Lanes(builder, width)
            numbers = [context.cast(builder, value, kind, types.int64) for kind, value in parts(4)]
            run = Sending(*numbers)
            found = Packets(*(pointer(kind, value) for kind, value in parts(2)))
            source = _Source(lanes, pointer(u, args[0]), pointer(u_new, args[1]), found)
            cells = pointer(line, args[3])
            with for_range(builder, run.stop, run.begin) as loop:
                begin = builder.add(run.now, source.number(found.delays, loop.index))
                for step, arriving in enumerate(source.sums(loop.index)):
                    turn = builder.and_(builder.add(begin, ir.Constant(WORD, step)), run.last)
                    at = source.times(builder.add(run.line, turn), width)
                    lanes.store(lanes.plus(lanes.load(cells, at), arriving), cells, at)
            return context.get_dummy_value()

        return types.void(u, u_new, packets, line, sending), codegen

    return send
