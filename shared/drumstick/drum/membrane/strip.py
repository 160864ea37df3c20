"""A strip of the mesh, some rows at once from left to right, as explicit vector code: what all sweeps are made of.

Rows side by side share their sums: a row's pairs of neighbours serve the row above and the row below. Away from the rim
all junctions weigh the same, so that weights are loaded only left and right of `inner` .. `outer`.

What lies a lane to the left or right comes from vectors that are there already, shifted, or from memory again. Sixteen
lanes fill a cache line: loaded a lane aside they always straddle two, and shifting costs less. Eight straddle two every
other time, and shifting them takes two instructions: loading costs less, up to 1.7 times (drumstick lab mesh-kernel).

Any thread, at compile time. A vector left and right of the strip and the rows above and below belong to the arrays.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from llvmlite import ir

from drumstick.drum.membrane.lattice import MESH_LANES, STRIP_ROWS
from drumstick.drum.membrane.simd import WORD, Lanes
from drumstick.drum.membrane.terms import LEFT, LEVEL, RIGHT

# Turns (i, centre, neighbour_sum, weight, sums so far) of a vector of junctions into the sums after it; i is its flat
# index.
Turn = Callable[[Any, Any, Any, Any, list[Any]], list[Any]]


class Strip(NamedTuple):
    """Place of a strip: u and weights are pointers, the rest flat indices (int64) in its first row, `side` its side."""

    u: Any
    weights: Any
    stride: Any
    start: Any
    inner: Any
    outer: Any
    stop: Any
    side: int


class _Seen(NamedTuple):
    # Of a row at one place: a vector, the sum of its left and right neighbours, its pairs as the rows beside see them.
    centre: Any
    along: Any
    pairs: Any


class _Row:
    # One row as the loop passes along it. `own` rows are computed; the two beside them only lend their pairs.
    def __init__(self, lanes: Lanes, strip: Strip, number: int) -> None:
        self._lanes = lanes
        self._u = strip.u
        self._offset = lanes.builder.mul(strip.stride, ir.Constant(WORD, number))
        self._shifts = lanes.width == MESH_LANES
        self._own = 0 <= number < STRIP_ROWS
        # The rows that it is beside have the other side, and see two of its columns: this one and one of the next.
        self._side = strip.side if number % 2 == 0 else -strip.side
        self._to_left = self._own or self._side == RIGHT
        self._to_right = self._own or self._side == LEFT

    def place(self, i):
        """Flat index of the row's vector above or below i."""
        return self._lanes.builder.add(i, self._offset)

    def _load(self, i, aside: int):
        place = self._lanes.builder.add(self.place(i), ir.Constant(WORD, aside))
        return self._lanes.load(self._u, place, aligned=aside % self._lanes.width == 0)

    def first(self, i) -> list[Any]:
        """State with which the loop begins."""
        if not self._shifts:
            return []
        ahead = [(-MESH_LANES, self._to_left), (0, self._to_right)]
        return [self._load(i, aside) for aside, is_kept in ahead if is_kept]

    def seen(self, i, kept: list[Any]) -> tuple[_Seen, list[Any]]:
        """Vector at i, and what to keep for the next place."""
        lanes = self._lanes
        if self._shifts:
            centre = kept[-1] if self._to_right else self._load(i, 0)
            coming = self._load(i, MESH_LANES) if self._to_right else None
            before = lanes.before(kept[0], centre) if self._to_left else None
            after = lanes.after(centre, coming) if self._to_right else None
            onward = [(centre, self._to_left), (coming, self._to_right)]
            kept = [vector for vector, is_kept in onward if is_kept]
        else:
            centre = self._load(i, 0)
            before = self._load(i, -1) if self._to_left else None
            after = self._load(i, 1) if self._to_right else None
        along = lanes.plus(before, after) if self._own else None
        if self._side == LEVEL:
            return _Seen(centre, along, centre), kept
        return _Seen(centre, along, lanes.plus(centre, before if self._side == RIGHT else after)), kept


class _Walk:
    # Along a strip, in parts that differ in where weights come from; `at`, `kept` and `sums` go from part to part.
    def __init__(self, lanes: Lanes, strip: Strip, sums: int, turn: Turn) -> None:
        self._lanes = lanes
        self._strip = strip
        self._turn = turn
        self._rows = [_Row(lanes, strip, number) for number in range(-1, STRIP_ROWS + 1)]
        self._at = strip.start
        self._kept = [row.first(strip.start) for row in self._rows]
        self.sums = [lanes.zero] * sums

    def on(self, stop, even: Any = None) -> None:
        """Emit the loop as far as `stop`; `even` is the weight of all junctions, None to load them."""
        builder = self._lanes.builder
        flat = [self._at, *self.sums, *(vector for kept in self._kept for vector in kept)]
        head, body, end = (builder.append_basic_block(name) for name in ("strip", "vectors", "beyond"))
        entry = builder.block
        builder.branch(head)
        builder.position_at_end(head)
        nodes = [builder.phi(value.type) for value in flat]
        for node, value in zip(nodes, flat, strict=True):
            node.add_incoming(value, entry)
        self._take(nodes)
        builder.cbranch(builder.icmp_signed("<", self._at, stop), body, end)
        builder.position_at_end(body)
        for node, value in zip(nodes, self._vectors(even), strict=True):
            node.add_incoming(value, builder.block)
        builder.branch(head)
        builder.position_at_end(end)

    def _take(self, nodes: list[Any]) -> None:
        self._at, rest = nodes[0], nodes[1:]
        self.sums, rest = rest[: len(self.sums)], rest[len(self.sums) :]
        counts = [len(kept) for kept in self._kept]
        self._kept = [[rest.pop(0) for _ in range(count)] for count in counts]

    def _vectors(self, even: Any) -> list[Any]:
        # One vector of every row; returns the next turn's index, sums and vectors.
        lanes, i, sums = self._lanes, self._at, self.sums
        found = [row.seen(i, kept) for row, kept in zip(self._rows, self._kept, strict=True)]
        seen = [now for now, _ in found]
        for number in range(1, len(seen) - 1):
            own, above, below = seen[number], seen[number - 1].pairs, seen[number + 1].pairs
            if self._strip.side == LEVEL:
                neighbour_sum = lanes.plus(own.along, lanes.plus(above, below))
            else:
                neighbour_sum = lanes.plus(lanes.plus(own.along, above), below)
            place = self._rows[number].place(i)
            weight = lanes.load(self._strip.weights, place) if even is None else even
            sums = self._turn(place, own.centre, neighbour_sum, weight, sums)
        onward = lanes.builder.add(i, ir.Constant(WORD, lanes.width))
        return [onward, *sums, *(vector for _, kept in found for vector in kept)]


def walk(lanes: Lanes, strip: Strip, sums: int, turn: Turn) -> list[Any]:
    """Emit the loops over a strip; returns its sums, as vectors."""
    going = _Walk(lanes, strip, sums, turn)
    going.on(strip.inner)
    even = lanes.everywhere(lanes.builder.load(lanes.builder.gep(strip.weights, [strip.inner])))
    going.on(strip.outer, even)
    going.on(strip.stop)
    return going.sums
