"""C functions called by address: arguments arrive, and a struct returned by value comes back whole."""

import ctypes
import platform
import re
import subprocess
import sys
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import numpy.typing as npt
import pytest
from llvmlite import ir
from numba.core.errors import TypingError

from realtime.kernels import foreign
from realtime.kernels.foreign import (
    AAPCS64,
    HIDDEN,
    SYSV,
    call_for_words,
    call_u32,
    call_u32_pointer,
    three_words,
)
from realtime.kernels.jit import allocations, njit

needs_compiler = pytest.mark.needs("cc")
WORDS = (0x302, -7, 0xFFFFFFFE)
SOURCE = """
typedef struct { unsigned a; int b; unsigned c; } Words;
Words words(void) { Words w = {0x302u, -7, 0xFFFFFFFEu}; return w; }
#ifdef __x86_64__
__attribute__((ms_abi)) Words words_as_windows_does(void) { return words(); }
#endif
static unsigned got;
void one(unsigned x) { got = x; }
unsigned last(void) { return got; }
void two(unsigned x, double *out) { out[1] = 2.0 * x; }
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("words")
    (folder / "words.c").write_text(SOURCE, encoding="utf-8")
    built = folder / "words.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", built, folder / "words.c"], check=True, timeout=60)
    return ctypes.CDLL(str(built))


def address(library: ctypes.CDLL, name: str) -> int:
    return ctypes.cast(getattr(library, name), ctypes.c_void_p).value or 0


@needs_compiler
def test_a_struct_by_value_comes_back_whole(library: ctypes.CDLL) -> None:
    assert three_words(address(library, "words")) == WORDS


@njit()
def _many(at: int, turns: int) -> int:
    total = 0
    for _ in range(turns):
        a, b, c = three_words(at)
        total += a + b + c
    return total


@needs_compiler
def test_a_million_calls_allocate_nothing_and_leave_the_stack_as_it_was(library: ctypes.CDLL) -> None:
    at = address(library, "words")
    counts = [allocations()]
    for turns in (1, 1_000_000):
        assert _many(at, turns) == turns * sum(WORDS)
        counts.append(allocations())
    assert counts[2] - counts[1] == counts[1] - counts[0]


@njit()
def _both(one: int, two: int, out: npt.NDArray[np.float64]) -> None:
    call_u32(one, 0xFFFFFFFF)
    call_u32_pointer(two, 0x2050, out.ctypes.data)


@needs_compiler
def test_arguments_arrive(library: ctypes.CDLL) -> None:
    out = np.zeros(3)
    _both(address(library, "one"), address(library, "two"), out)
    assert library.last() & 0xFFFFFFFF == 0xFFFFFFFF
    assert out.tolist() == [0.0, 2.0 * 0x2050, 0.0]


def test_what_is_no_address_is_refused_when_it_is_compiled() -> None:
    with pytest.raises(TypingError):
        three_words("somewhere")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("system", "machine", "rule"),
    [
        ("linux", "x86_64", SYSV),
        ("darwin", "x86_64", SYSV),
        ("linux", "aarch64", AAPCS64),
        ("darwin", "arm64", AAPCS64),
        ("win32", "ARM64", AAPCS64),
        ("win32", "AMD64", HIDDEN),
    ],
)
def test_each_platform_has_its_rule(system: str, machine: str, rule: str) -> None:
    assert foreign.rule_of(system, machine) == rule


def test_a_platform_without_a_rule_is_refused() -> None:
    with pytest.raises(NotImplementedError, match="armv7l"):
        foreign.rule_of("linux", "armv7l")


def module_that_returns(word: int, rule: str, convention: str = "") -> str:
    """LLVM's text of `u32 pick(i64 address)`: the word of this number out of the struct."""
    module = ir.Module()
    function = ir.Function(module, ir.FunctionType(ir.IntType(32), [ir.IntType(64)]), "pick")
    builder = ir.IRBuilder(function.append_basic_block())
    room = builder.alloca(ir.IntType(32), 3)
    builder.ret(call_for_words(builder, rule, function.args[0], room, convention)[word])
    return str(module)


def machine_for(triple: str) -> Any:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple(triple).create_target_machine(opt=2)


@needs_compiler
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="both conventions of x86-64")
@pytest.mark.parametrize(
    ("rule", "convention", "function"),
    [(SYSV, "x86_64_sysvcc", "words"), (HIDDEN, "win64cc", "words_as_windows_does")],
)
def test_both_rules_of_x86_run_here(library: ctypes.CDLL, rule: str, convention: str, function: str) -> None:
    """gcc can compile a function as Windows calls it, so that rule is executed too, on this machine."""
    for word, expected in enumerate(WORDS):
        module = llvm.parse_assembly(module_that_returns(word, rule, convention))
        module.triple = llvm.get_default_triple()
        engine = llvm.create_mcjit_compiler(module, machine_for(llvm.get_default_triple()))
        engine.finalize_object()
        pick = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_int64)(engine.get_function_address("pick"))
        assert pick(address(library, function)) == expected & 0xFFFFFFFF


@pytest.mark.parametrize("triple", ["aarch64-linux-gnu", "arm64-apple-darwin", "aarch64-pc-windows-msvc"])
def test_on_arm_the_words_are_taken_from_x0_and_x1(triple: str) -> None:
    """Not run, only looked at: after the call, words 0 and 1 are halves of x0, word 2 is the low half of x1."""
    after_call: list[str] = []
    for word in range(3):
        module = llvm.parse_assembly(module_that_returns(word, AAPCS64))
        module.triple = triple
        text = machine_for(triple).emit_assembly(module)
        assert "x8" not in re.split(r"\bblr?\b|\bbr\b", text)[0], "x8 is the hidden pointer of larger structs"
        after_call.append(re.split(r"\bblr\s+x\d+|\bbr\s+x\d+", text)[1])
    assert not re.search(r"\bx1\b|\bw1\b", after_call[0])
    assert re.search(r"lsr\s+x0, x0, #32", after_call[1])
    assert re.search(r"mov\s+[wx]0, [wx]1\b", after_call[2])


def test_on_windows_the_hidden_pointer_goes_in_rcx() -> None:
    """Only looked at: the real Windows compiler's target, beside the run above with its convention."""
    module = llvm.parse_assembly(module_that_returns(2, HIDDEN))
    module.triple = "x86_64-pc-windows-msvc"
    text = machine_for("x86_64-pc-windows-msvc").emit_assembly(module)
    before, after = re.split(r"callq?\s+\*?%r\w+", text)
    assert re.search(r"leaq?\s+\d+\(%rsp\), %rcx", before)
    assert re.search(r"movl\s+\d+\(%rsp\), %eax", after)


def test_this_platform_has_a_rule() -> None:
    assert foreign.rule_of(sys.platform, platform.machine()) in (SYSV, AAPCS64, HIDDEN)
