"""A named tuple of arrays for a foreign thread: left in memory as compiled code holds it, taken up by its address.

A C callback gets one pointer. What it works on is a tuple of arrays of records, whose types differ from scene to scene;
here the compiler itself lays that tuple out and reads it back, so that no table of addresses has to be kept in step.
The thread that takes it up borrows the arrays: it counts no references, so nothing is ever freed there.
"""

from typing import Any

import numpy as np
from numba import typeof, types
from numba.core import cgutils
from numba.core.registry import cpu_target
from numba.extending import intrinsic

from realtime.kernels.jit import njit


def is_plain(kind) -> bool:
    """True when a value of this numba type is made of arrays and numbers only."""
    if isinstance(kind, types.BaseTuple):
        return all(is_plain(member) for member in kind)
    return isinstance(kind, types.Array | types.Number | types.NoneType)


def borrowed(context, builder, kind, value):
    """Compile-time view of a value's arrays without their owners, so that numba counts no references to them."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        members = [
            borrowed(context, builder, member, cgutils.unpack_tuple(builder, value)[i])
            for i, member in enumerate(kind)
        ]
        return context.make_tuple(builder, kind, members)
    return value


def _pointer(context, builder, address, sign, kind):
    whole = context.cast(builder, address, sign, types.intp)
    return builder.inttoptr(whole, context.get_value_type(kind).as_pointer())


@intrinsic
def _leave(typingctx, address, value):
    if not (isinstance(address, types.Integer) and is_plain(value)):
        return None

    def codegen(context, builder, signature, args):
        kind = signature.args[1]
        pointer = _pointer(context, builder, args[0], signature.args[0], kind)
        builder.store(borrowed(context, builder, kind, args[1]), pointer)
        return context.get_dummy_value()

    return types.void(address, value), codegen


@intrinsic
def _take_up(typingctx, address, kind):
    if not (isinstance(address, types.Integer | types.RawPointer) and isinstance(kind, types.TypeRef)):
        return None
    returned = kind.instance_type

    def codegen(context, builder, signature, args):
        if isinstance(signature.args[0], types.RawPointer):
            pointer = builder.bitcast(args[0], context.get_value_type(returned).as_pointer())
        else:
            pointer = _pointer(context, builder, args[0], signature.args[0], returned)
        return builder.load(pointer)

    return returned(address, kind), codegen


# load_from_address(address, kind): the value left at `address`; `kind` is its `ForeignHandle.kind`, fixed when the
# caller is compiled. Any thread; no allocation. From compiled code only.
load_from_address: Any = _take_up


@intrinsic
def _take_up_typed(typingctx, address):
    if not isinstance(address, types.CPointer):
        return None
    returned = address.dtype

    def codegen(context, builder, signature, args):
        pointer = builder.bitcast(args[0], context.get_value_type(returned).as_pointer())
        return builder.load(pointer)

    return returned(address), codegen


# take_up_typed(address): the same by an address whose own type says what lies there, as `typed_callback` declares it.
take_up_typed: Any = _take_up_typed


def typed_callback(kind: Any, *arguments: Any) -> Any:
    """Signature of `void f(kind *, arguments...)`: the kind is no closure, so what is compiled is found again."""
    return types.void(types.CPointer(kind), *arguments)


def _size_of(kind) -> int:
    context = cpu_target.target_context
    return context.get_abi_sizeof(context.get_value_type(kind))


@njit()
def _put(address, value):
    _leave(address, value)


class ForeignHandle:
    """A value left for foreign threads. Both the arrays and this object must outlive their use. Control thread."""

    def __init__(self, value: Any, like: "ForeignHandle | None" = None) -> None:
        """like: a handle of a value of the same type, which saves some ms of finding out that type."""
        self.kind = typeof(value) if like is None else like.kind
        self._owner = value
        self._memory = np.zeros(_size_of(self.kind) // 8 + 1 if like is None else len(like._memory), np.int64)
        _put(self.address, value)

    @property
    def address(self) -> int:
        """Address for `load_from_address` and `take_up_typed`."""
        return int(self._memory.ctypes.data)
