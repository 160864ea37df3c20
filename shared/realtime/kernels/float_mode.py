"""Denormal numbers off and on again, for compiled audio threads.

A decaying float32 mesh ends in denormals, which slow a whole step some 40 times on x86 (one instruction up to 150
times). The mode belongs to the thread: a thread
that goes back to Python must restore it, because numpy and Python promise IEEE results. On other processors both
functions do nothing, and whoever uses them must not rely on them alone.
"""

import platform

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from realtime.kernels.jit import njit

_FLUSH_TO_ZERO, _DENORMALS_ARE_ZERO = 0x8000, 0x0040
HAS_MODE = platform.machine() in ("x86_64", "AMD64")


def _mxcsr(builder, name, pointer):
    function_type = ir.FunctionType(ir.VoidType(), [ir.IntType(8).as_pointer()])
    function = cgutils.get_or_insert_function(builder.module, function_type, f"llvm.x86.sse.{name}")
    builder.call(function, [builder.bitcast(pointer, ir.IntType(8).as_pointer())])


@intrinsic
def _flush(typingctx):

    def codegen(context, builder, signature, args):
        if not HAS_MODE:
            return ir.Constant(ir.IntType(32), 0)
        cell = cgutils.alloca_once(builder, ir.IntType(32))
        _mxcsr(builder, "stmxcsr", cell)
        before = builder.load(cell)
        bits = ir.Constant(ir.IntType(32), _FLUSH_TO_ZERO | _DENORMALS_ARE_ZERO)
        builder.store(builder.or_(before, bits), cell)
        _mxcsr(builder, "ldmxcsr", cell)
        return before

    return types.int32(), codegen


@intrinsic
def _restore(typingctx, mode):
    if mode != types.int32:
        return None

    def codegen(context, builder, signature, args):
        if HAS_MODE:
            cell = cgutils.alloca_once(builder, ir.IntType(32))
            builder.store(args[0], cell)
            _mxcsr(builder, "ldmxcsr", cell)
        return context.get_dummy_value()

    return types.void(mode), codegen


@njit()
def flush_denormals() -> int:
    """Turn denormals to zero on this thread; returns the mode that was, for `restore`. No allocation."""
    return _flush()


@njit()
def restore(mode: int) -> None:
    """Give this thread the mode that `flush_denormals` returned."""
    _restore(np.int32(mode))
