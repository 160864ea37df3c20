"""Equality after a round trip through 32 bits: a value that comes back from OSC must not count as another one.

Pure; any thread.
"""

import struct

from drumstick.scenes.table import Parameter

_FLOAT = struct.Struct(">f")
_STEP = 2.0**-23  # from one 32-bit number to the next: never more than this share of it


def as_float32(value: float) -> float:
    """The nearest 32-bit number; `value` lies within the range of one."""
    return _FLOAT.unpack(_FLOAT.pack(value))[0]


def is_same(value: float, present: float) -> bool:
    """True when a 32-bit client cannot tell these two apart. NaN is never the same."""
    return as_float32(value) == as_float32(present)


def is_norm_of(row: Parameter, norm: float, present: float) -> bool:
    """True when `norm` is how a client that knows `present` to 32 bits would write it over 0..1, in 32 bits again."""
    slack = abs(present) * _STEP
    return as_float32(row.norm(present - slack)) <= norm <= as_float32(row.norm(present + slack))
