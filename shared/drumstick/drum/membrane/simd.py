"""Vectors of float32 for code that is written in the compiler's own language: as wide as the processor's.

Any thread; for membrane.rows, modal.blocks and output.arrivals, at compile time.
"""

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba.core.cgutils import get_or_insert_function

WORD = ir.IntType(64)
_LANE = ir.IntType(32)
FLOAT = ir.FloatType()
# No care for the sign of zero; the order of sums stays as written.
_FLAGS = ("nsz",)


def widest(features: dict[str, bool]) -> int:
    """Lanes of float32 that a processor with these features (LLVM's names) computes at once: 4 at least."""
    if features.get("avx512f"):
        return 16
    return 8 if features.get("avx") else 4


def features() -> dict[str, bool]:
    """Features of the processor compiled for: this one, unless NUMBA_CPU_FEATURES ("+avx2,-avx512f") says another."""
    if numba.config.CPU_FEATURES is None:
        return dict(llvm.get_host_cpu_features())
    return {word[1:]: word[0] == "+" for word in numba.config.CPU_FEATURES.split(",") if word}


WIDTH = widest(features())


class Lanes:
    """Vectors of `width` lanes; plain floats for width 1."""

    def __init__(self, builder, width) -> None:
        self.builder = builder
        self.width = width
        self.kind = ir.VectorType(FLOAT, width) if width > 1 else FLOAT

    @property
    def zero(self):
        """All lanes 0."""
        return ir.Constant(self.kind, None if self.width > 1 else 0.0)

    def everywhere(self, number):
        """The number in every lane."""
        if self.width == 1:
            return number
        nothing = ir.Constant(self.kind, ir.Undefined)
        first = self.builder.insert_element(nothing, number, ir.Constant(_LANE, 0))
        return self.builder.shuffle_vector(first, nothing, self._chosen([0] * self.width))

    def _chosen(self, numbers):
        constants = [ir.Constant(_LANE, number) for number in numbers]
        return ir.Constant(ir.VectorType(_LANE, len(constants)), constants)

    def after(self, first, second):
        """Vector a lane to the right of `first`, when `second` follows it. Not for width 1."""
        return self._shifted(first, second, 1)

    def before(self, first, second):
        """Vector a lane to the left of `second`, when it follows `first`. Not for width 1."""
        return self._shifted(first, second, self.width - 1)

    def _shifted(self, first, second, begin):
        return self.builder.shuffle_vector(first, second, self._chosen(range(begin, begin + self.width)))

    def _place(self, base, index):
        return self.builder.bitcast(self.builder.gep(base, [index]), self.kind.as_pointer())

    def load(self, base, index, aligned: bool = True):
        """Load from an address that is aligned to the vector, or to its lanes only."""
        value = self.builder.load(self._place(base, index))
        value.align = 4 * self.width if aligned else 4
        return value

    def store(self, value, base, index, aligned: bool = True):
        """Store to an address that is aligned to the vector, or to its lanes only."""
        self.builder.store(value, self._place(base, index)).align = 4 * self.width if aligned else 4

    def plus(self, a, b):
        """a + b."""
        return self.builder.fadd(a, b, flags=_FLAGS)

    def minus(self, a, b):
        """a - b."""
        return self.builder.fsub(a, b, flags=_FLAGS)

    def times(self, a, b):
        """a b."""
        return self.builder.fmul(a, b, flags=_FLAGS)

    def sum_with_product(self, a, b, c):
        """a b + c, rounded once where the processor does that: which product it is, is no choice of the compiler's."""
        name = f"llvm.fmuladd.v{self.width}f32" if self.width > 1 else "llvm.fmuladd.f32"
        kind = ir.FunctionType(self.kind, [self.kind] * 3)
        return self.builder.call(get_or_insert_function(self.builder.module, kind, name), [a, b, c])

    def negative(self, a):
        """-a."""
        return self.builder.fneg(a, flags=_FLAGS)

    def size(self, a):
        """|a|."""
        name = f"llvm.fabs.v{self.width}f32" if self.width > 1 else "llvm.fabs.f32"
        kind = ir.FunctionType(self.kind, [self.kind])
        return self.builder.call(get_or_insert_function(self.builder.module, kind, name), [a])

    def sum(self, vector):
        """Sum the lanes, halves to halves: the same order on every machine of this width."""
        width = self.width
        while width > 1:
            width //= 2
            nothing = ir.Constant(vector.type, ir.Undefined)
            low = self.builder.shuffle_vector(vector, nothing, self._chosen(range(width)))
            high = self.builder.shuffle_vector(vector, nothing, self._chosen(range(width, 2 * width)))
            vector = self.plus(low, high)
        if self.width == 1:
            return vector
        return self.builder.extract_element(vector, ir.Constant(_LANE, 0))
