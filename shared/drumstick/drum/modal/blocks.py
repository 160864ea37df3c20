"""Many steps of a bank of modes at once, as explicit vector code: for a bank whose modes nothing couples meanwhile.

Between mallets, and without tension, modes know nothing of one another; nor do they where the tension's pull on each
step is known beforehand (drumstick.drum.modal.apart). So a tile of them takes all steps of a block before the next tile
begins, and its q and d stay in the processor's registers meanwhile, as do the coefficients; what is heard of it is
added up lane by lane for each step, and the lanes only at the end. The step is that of
drumstick.drum.modal.bank, but for where it rounds. Whatever the length of a block, the same bits come out.

A step of four vectors is twenty additions and multiplications, whose turn takes as long as one vector's d' and q' take
after one another: so four vectors make a tile, also where there are registers for fewer (two would cost half as much
again).

Kernels: audio thread; no allocation, no branch but the loops'. Vectors are as wide as the processor's.
"""

from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from drumstick.drum.membrane.simd import WIDTH, WORD, Lanes
from drumstick.drum.memory.bank import STEPS, Bank
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

_VECTORS = 4


class _Tile:
    # _VECTORS vectors of modes, which begin at the mode `at`: from memory, or in cells that end up in registers.
    def __init__(self, lanes, at) -> None:
        self._lanes = lanes
        self._places = [
            lanes.builder.add(at, ir.Constant(WORD, number * lanes.width)) for number in range(_VECTORS)
        ]

    def load(self, base):
        return [self._lanes.load(base, place, aligned=False) for place in self._places]

    def store(self, vectors, base) -> None:
        for vector, place in zip(vectors, self._places, strict=True):
            self._lanes.store(vector, base, place, aligned=False)


def _cells(builder, vectors):
    return [cgutils.alloca_once_value(builder, vector) for vector in vectors]


def _read(builder, cells):
    return [builder.load(cell) for cell in cells]


def _write(builder, vectors, cells) -> None:
    for vector, cell in zip(vectors, cells, strict=True):
        builder.store(vector, cell)


class _Block:
    # The block of one call; arrays by the address of their first number.
    def __init__(self, lanes, arrays, pulses, steps) -> None:
        self._lanes = lanes
        self._builder = lanes.builder
        self._modes, self._weights, self._rows, self._forces, self._pulls, self._sums, self._heard = arrays
        self._size, self._pulses = pulses
        self._steps = steps

    def _times(self, index, number):
        return self._builder.mul(index, ir.Constant(WORD, number))

    def _of_sums(self):
        # The place of every vector of sums, in a loop: left and right of each step.
        return cgutils.for_range(self._builder, self._times(self._steps, 2))

    def run(self) -> None:
        lanes, builder = self._lanes, self._builder
        with self._of_sums() as each:
            lanes.store(lanes.zero, self._sums, self._times(each.index, lanes.width))
        tile = _VECTORS * lanes.width
        with cgutils.for_range(builder, builder.udiv(self._size, ir.Constant(WORD, tile))) as tiles:
            self._stepped(self._times(tiles.index, tile))
        with self._of_sums() as each:
            total = lanes.sum(lanes.load(self._sums, self._times(each.index, lanes.width)))
            builder.store(total, builder.gep(self._heard, [each.index]))

    def _stepped(self, at) -> None:
        # All steps of one tile.
        lanes, builder, tile = self._lanes, self._builder, _Tile(self._lanes, at)
        q_base, d_base, r_squared_base, stiffness_base, *gain_bases, tension_base = self._modes
        q_cells, d_cells = (_cells(builder, tile.load(base)) for base in (q_base, d_base))
        r_squared = tile.load(r_squared_base)
        pull = [lanes.negative(stiffness) for stiffness in tile.load(stiffness_base)]
        gains = [None if base is None else tile.load(base) for base in gain_bases]
        tension = None if tension_base is None else tile.load(tension_base)
        with cgutils.for_range(builder, self._steps) as steps:
            self._driven(d_cells, at, steps.index)
            if tension is not None:
                self._drawn(d_cells, q_cells, tension, steps.index)
            kept = [lanes.times(*pair) for pair in zip(r_squared, _read(builder, d_cells), strict=True)]
            still = _read(builder, q_cells)
            d = [lanes.sum_with_product(*three) for three in zip(pull, still, kept, strict=True)]
            q = [lanes.plus(*pair) for pair in zip(still, d, strict=True)]
            _write(builder, d, d_cells)
            _write(builder, q, q_cells)
            for side in range(2):
                self._hear(steps.index, side, ((gains[side], d), (gains[2 + side], q)))
        tile.store(_read(builder, q_cells), q_base)
        tile.store(_read(builder, d_cells), d_base)

    def _driven(self, d_cells, at, step) -> None:
        # d and what each pulse adds to it.
        lanes, builder = self._lanes, self._builder
        with cgutils.for_range(builder, self._pulses) as pulses:
            place = builder.add(self._times(pulses.index, STEPS), step)
            force = lanes.everywhere(builder.load(builder.gep(self._forces, [place])))
            row = builder.load(builder.gep(self._rows, [pulses.index]))
            weights = _Tile(lanes, builder.add(builder.mul(row, self._size), at)).load(self._weights)
            d = _read(builder, d_cells)
            driven = [
                lanes.sum_with_product(weight, force, old) for weight, old in zip(weights, d, strict=True)
            ]
            _write(builder, driven, d_cells)

    def _drawn(self, d_cells, q_cells, tension, step) -> None:
        # d less what the tension's pull takes of it.
        lanes, builder = self._lanes, self._builder
        pull = lanes.everywhere(builder.load(builder.gep(self._pulls, [step])))
        back = [
            lanes.negative(lanes.times(*pair)) for pair in zip(tension, _read(builder, q_cells), strict=True)
        ]
        d = [
            lanes.sum_with_product(pull, each, old)
            for each, old in zip(back, _read(builder, d_cells), strict=True)
        ]
        _write(builder, d, d_cells)

    def _hear(self, step, side: int, heard) -> None:
        lanes, builder = self._lanes, self._builder
        number = builder.add(self._times(step, 2), ir.Constant(WORD, side))
        place = self._times(number, lanes.width)
        total = lanes.load(self._sums, place)
        for gains, values in heard:
            for gain, value in zip(gains or [], values, strict=False):
                total = lanes.sum_with_product(gain, value, total)
        lanes.store(total, self._sums, place)


def block_of(width: int) -> Any:
    """The intrinsic for a block in vectors of `width` lanes, for compiled code.

    block(modes, driving, sums, heard, pulses, steps). modes: `arrays_of` a bank, or a whole number of tiles of each;
    driving: strike_weights, rows and forces, of which the first `pulses` count, and pulls; the rest as in `Blocks`.
    """

    @intrinsic
    def block(typingctx, modes, driving, sums, heard, pulses, steps):
        def codegen(context, builder, signature, args):
            def array(kind, value):
                return context.make_array(kind)(context, builder, value)

            def parts(at):
                return [
                    (kind, builder.extract_value(args[at], number))
                    for number, kind in enumerate(signature.args[at].types)
                ]

            modes = parts(0)
            bases = [
                None if isinstance(kind, types.NoneType) else array(kind, value).data for kind, value in modes
            ]
            others = [*parts(1), *zip(signature.args[2:4], args[2:4], strict=True)]
            size = builder.extract_value(array(*modes[0]).shape, 0)
            arrays = (bases, *(array(kind, value).data for kind, value in others))
            _Block(Lanes(builder, width), arrays, (size, args[4]), args[5]).run()
            return context.get_dummy_value()

        return types.void(modes, driving, sums, heard, types.int64, types.int64), codegen

    return block


_block = block_of(WIDTH)


@only_with("left_by_displacement")
def _left_still(bank: Bank, first: int, last: int) -> Any:
    return bank.left_by_displacement[first:last]


@only_with("right_by_displacement")
def _right_still(bank: Bank, first: int, last: int) -> Any:
    return bank.right_by_displacement[first:last]


@only_with("tension_stiffness")
def _by_tension(bank: Bank, first: int, last: int) -> Any:
    return bank.tension_stiffness[first:last]


@njit()
def arrays_of(bank: Bank, first: int, last: int) -> Any:
    """q, d, r_squared, stiffness, the gains and tension_stiffness of these modes; None for what the bank has not."""
    return (
        bank.q[first:last],
        bank.d[first:last],
        bank.r_squared[first:last],
        bank.stiffness[first:last],
        bank.left[first:last],
        bank.right[first:last],
        _left_still(bank, first, last),
        _right_still(bank, first, last),
        _by_tension(bank, first, last),
    )


@njit()
def run_modes(engine: "Engine", first: int, last: int, pulses: int, steps: int) -> None:
    """So many steps of these modes, driven by the first `pulses` of `rows` and `forces`; into `heard`."""
    modes, blocks = engine.modal, engine.blocks
    _block(
        arrays_of(modes, first, last),
        (modes.strike_weights, blocks.rows, blocks.forces, blocks.pulls),
        blocks.sums,
        blocks.heard,
        pulses,
        steps,
    )


@only_with("blocks")
def run(engine: "Engine", pulses: int, steps: int) -> None:
    """Take so many steps of all modes at once; `handed_out` tells them."""
    run_modes(engine, 0, engine.modal.q.shape[0], pulses, steps)
    hand_out(engine, steps)


@only_with("blocks")
def hand_out(engine: "Engine", steps: int) -> None:
    """So many steps have been taken, and are to be handed out."""
    engine.blocks.state[0].steps, engine.blocks.state[0].taken = steps, 0


@only_with("blocks", otherwise=False)
def is_ahead(engine: "Engine") -> bool:
    """True while the bank has taken steps that have not been handed out, the coming one among them."""
    state = engine.blocks.state[0]
    return bool(state.taken < state.steps)


@only_with("blocks", otherwise=(0.0, 0.0))
def handed_out(engine: "Engine") -> Any:
    """Output of the coming step, left and right, which a block has taken."""
    blocks = engine.blocks
    step = blocks.state[0].taken
    blocks.state[0].taken = step + 1
    return float(blocks.heard[step, 0]), float(blocks.heard[step, 1])
