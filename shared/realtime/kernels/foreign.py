"""C functions called by address from compiled code: a vendor's library inside a callback, without Python.

The address is an ordinary integer, so the compiled code can be cached and any copy of a library can be called. Tick
thread: what the foreign function does is its own affair; the call itself neither blocks nor allocates.

A struct of three 32-bit words that C returns *by value* comes back by a rule of the platform:

| rule | where | how | source |
|---|---|---|---|
| SYSV | x86-64, not Windows | words 0 and 1 in rax, word 2 in rdx | System V ABI, AMD64 supplement, 3.2.3 |
| AAPCS64 | aarch64, every system | words 0 and 1 in x0, word 2 in x1 | Procedure Call Standard for Arm 64, 6.9 |
| HIDDEN | x86-64, Windows | written where rcx points, the hidden first argument | Microsoft, x64 calling convention |
"""

import platform
import sys
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from realtime.kernels.jit import njit

SYSV, AAPCS64, HIDDEN = "sysv", "aapcs64", "hidden"
_WORD, _PAIR = ir.IntType(32), ir.IntType(64)


def rule_of(system: str, machine: str) -> str:
    """Rule by which C returns twelve bytes by value on this platform, by `sys.platform` and `platform.machine`."""
    machine = machine.lower()
    if machine in ("aarch64", "arm64"):
        return AAPCS64
    if machine in ("x86_64", "amd64"):
        return HIDDEN if system == "win32" else SYSV
    raise NotImplementedError(f"{machine}: it is not known how C returns a struct by value here")


def _halves(builder, pair):
    high = builder.lshr(pair, ir.Constant(_PAIR, 32))
    return builder.trunc(pair, _WORD), builder.trunc(high, _WORD)


def call_for_words(builder, rule, address, room, convention=""):
    """Emit a call of `struct {u32, i32, u32} f(void)` at the i64 `address`; returns its three words.

    `room` points to three words; only HIDDEN uses it. `convention`: LLVM's name for another than the platform's own.
    """
    if rule == HIDDEN:
        function = ir.FunctionType(ir.VoidType(), [ir.IntType(32).as_pointer()])
        builder.call(builder.inttoptr(address, function.as_pointer()), [room], cconv=convention)
        return [builder.load(builder.gep(room, [ir.Constant(_WORD, i)])) for i in range(3)]
    returned = ir.ArrayType(_PAIR, 2) if rule == AAPCS64 else ir.LiteralStructType([_PAIR, _WORD])
    function = ir.FunctionType(returned, [])
    both = builder.call(builder.inttoptr(address, function.as_pointer()), [], cconv=convention)
    first, second = _halves(builder, builder.extract_value(both, 0))
    third = builder.extract_value(both, 1)
    return [first, second, builder.trunc(third, _WORD) if rule == AAPCS64 else third]


@intrinsic
def _three_words(typingctx, address):
    if not isinstance(address, types.Integer):
        return None
    rule = rule_of(sys.platform, platform.machine())

    def codegen(context, builder, signature, args):
        room = cgutils.alloca_once(builder, _WORD, size=3)
        target = context.cast(builder, args[0], signature.args[0], types.int64)
        words = call_for_words(builder, rule, target, room)
        signs = (types.uint32, types.int32, types.uint32)
        wide = [
            context.cast(builder, word, sign, types.int64) for word, sign in zip(words, signs, strict=True)
        ]
        return context.make_tuple(builder, signature.return_type, wide)

    return types.UniTuple(types.int64, 3)(address), codegen


def _void(*kinds):
    # A caller of void f(kinds...): the arguments are cast to what C expects.
    def typed(address, given):
        if not isinstance(address, types.Integer) or not all(isinstance(t, types.Integer) for t in given):
            return None

        def codegen(context, builder, signature, args):
            function = ir.FunctionType(ir.VoidType(), [context.get_value_type(kind) for kind in kinds])
            target = context.cast(builder, args[0], signature.args[0], types.int64)
            values = [
                context.cast(builder, value, sign, kind)
                for value, sign, kind in zip(args[1:], signature.args[1:], kinds, strict=True)
            ]
            builder.call(builder.inttoptr(target, function.as_pointer()), values)
            return context.get_dummy_value()

        return types.void(address, *given), codegen

    return typed


_void_of_word = _void(types.uint32)
_void_of_word_and_pointer = _void(types.uint32, types.intp)


@intrinsic
def _call_u32(typingctx, address, word):
    return _void_of_word(address, (word,))


@intrinsic
def _call_u32_pointer(typingctx, address, word, pointer):
    return _void_of_word_and_pointer(address, (word, pointer))


@njit()
def call_u32(address: int, word: int) -> None:
    """Call `void f(uint32_t)` at `address`."""
    _call_u32(address, word)


@njit()
def call_u32_pointer(address: int, word: int, pointer: int) -> None:
    """Call `void f(uint32_t, void *)` at `address`; `pointer` is an integer, as `array.ctypes.data` gives it."""
    _call_u32_pointer(address, word, pointer)


@intrinsic
def _call_block(typingctx, address, data, block, frames, flags):
    pointers = (types.Integer, types.RawPointer)
    if not (
        isinstance(address, types.Integer) and isinstance(data, pointers) and isinstance(block, pointers)
    ):
        return None

    def codegen(context, builder, signature, args):
        byte = ir.IntType(8).as_pointer()

        def pointer(at):
            kind = signature.args[at]
            if isinstance(kind, types.RawPointer):
                return args[at]
            return builder.inttoptr(context.cast(builder, args[at], kind, types.int64), byte)

        words = [context.cast(builder, args[at], signature.args[at], types.int64) for at in (3, 4)]
        function = ir.FunctionType(ir.VoidType(), [byte, byte, _PAIR, _PAIR])
        target = context.cast(builder, args[0], signature.args[0], types.int64)
        builder.call(builder.inttoptr(target, function.as_pointer()), [pointer(1), pointer(2), *words])
        return context.get_dummy_value()

    return types.void(address, data, block, frames, flags), codegen


# call_block(address, data, block, frames, flags): call `void f(void *, void *, int64_t, int64_t)` at `address`; `data`
# and `block` are integers or a callback's own pointers. From compiled code only.
call_block: Any = _call_block


@njit()
def three_words(address: int) -> tuple[int, int, int]:
    """Call `struct {uint32_t; int32_t; uint32_t} f(void)` at `address`; returns the three members."""
    return _three_words(address)
