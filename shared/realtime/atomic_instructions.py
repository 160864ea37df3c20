"""Atomic instructions of the processor in the compiler's own language, for `atomics`: at compile time."""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def _cell(context, builder, array_type, array_value, index):
    array = context.make_array(array_type)(context, builder, array_value)
    return cgutils.get_item_pointer(context, builder, array_type, array, [index], wraparound=False)


def _is_int64_array(array, *integers) -> bool:
    return (
        isinstance(array, types.Array)
        and array.dtype == types.int64
        and array.ndim == 1
        and all(isinstance(i, types.Integer) for i in integers)
    )


@intrinsic
def load_acquire(typingctx, cells, index):
    """cells[index], and everything written before its release store is visible."""
    if not _is_int64_array(cells, index):
        return None

    def codegen(context, builder, signature, args):
        index64 = context.cast(builder, args[1], signature.args[1], types.intp)
        pointer = _cell(context, builder, signature.args[0], args[0], index64)
        return builder.load_atomic(pointer, "acquire", 8)

    return types.int64(cells, index), codegen


@intrinsic
def store_release(typingctx, cells, index, value):
    """cells[index] = value, after everything written before."""
    if not _is_int64_array(cells, index, value):
        return None

    def codegen(context, builder, signature, args):
        index64 = context.cast(builder, args[1], signature.args[1], types.intp)
        pointer = _cell(context, builder, signature.args[0], args[0], index64)
        value64 = context.cast(builder, args[2], signature.args[2], types.int64)
        builder.store_atomic(value64, pointer, "release", 8)
        return context.get_dummy_value()

    return types.void(cells, index, value), codegen


def _rmw(operation):
    def typed(typingctx, cells, index, value):
        if not _is_int64_array(cells, index, value):
            return None

        def codegen(context, builder, signature, args):
            index64 = context.cast(builder, args[1], signature.args[1], types.intp)
            pointer = _cell(context, builder, signature.args[0], args[0], index64)
            value64 = context.cast(builder, args[2], signature.args[2], types.int64)
            return builder.atomic_rmw(operation, pointer, value64, "acq_rel")

        return types.int64(cells, index, value), codegen

    return typed


exchange = intrinsic(_rmw("xchg"))
add = intrinsic(_rmw("add"))


@intrinsic
def fence(typingctx):
    """Full fence: orders a seqlock's data reads before its second counter read."""

    def codegen(context, builder, signature, args):
        builder.fence("seq_cst")
        return ir.Constant(ir.IntType(64), 0)

    return types.int64(), codegen
