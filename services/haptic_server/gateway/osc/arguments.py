"""Checks of a message's arguments, and the refusal of one that is not acted on. Pure; any thread."""

import math
from collections.abc import Sequence

from drumstick.scenes.table import Parameter
from haptic_server.gateway.rounding import as_float32
from protocol.osc import Argument


class Refused(Exception):
    """A message that is not acted on: `reason` is what it is counted under, the text is for the sender.

    Without a text it is counted, and not answered.
    """

    def __init__(self, reason: str, why: str) -> None:
        super().__init__(why)
        self.reason = reason


def number(args: Sequence[Argument]) -> float:
    """The one number."""
    if len(args) != 1 or isinstance(args[0], str):
        raise Refused("arguments", "expects one number (to set it) or no argument (to query it)")
    return float(args[0])


def strike(args: Sequence[Argument]) -> tuple[float, float, float]:
    """The place and the level of a strike."""
    numbers = [float(each) for each in args if not isinstance(each, str)]
    if len(args) != 3 or len(numbers) != 3:
        raise Refused("arguments", "expects three numbers: x, y, level")
    return numbers[0], numbers[1], numbers[2]


def way(args: Sequence[Argument]) -> tuple[float, float]:
    """A value, and in how many seconds to come to it."""
    numbers = [float(each) for each in args if not isinstance(each, str)]
    if len(args) not in (1, 2) or len(numbers) != len(args):
        raise Refused("arguments", "expects a value, a value and seconds, or no argument (to query it)")
    return numbers[0], numbers[1] if len(numbers) == 2 else 0.0


def in_range(row: Parameter, value: float) -> float:
    """The value; one that rounding to 32 bits moved beyond a limit is the limit."""
    # A limit such as 1e-6 is no 32-bit number: what a client sends for it, or echoes back, lies a rounding beyond it.
    for limit in (row.quantity.low, row.quantity.high):
        if math.isfinite(value) and value == as_float32(limit):
            return limit
    return row.check(value)


def text(args: Sequence[Argument]) -> str:
    """The one text."""
    if len(args) != 1 or not isinstance(args[0], str):
        raise Refused("arguments", "send one text")
    return args[0]


def port(args: Sequence[Argument]) -> int:
    """The one port."""
    if len(args) == 1 and not isinstance(args[0], str):
        value = args[0]
        # Pd sends every number as a float.
        if math.isfinite(value) and value == int(value) and 1 <= value <= 65535:
            return int(value)
    raise Refused("arguments", "send one port, 1 to 65535")
