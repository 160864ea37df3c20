"""Arguments of the sweep over a strip, as compiled code names them: where the strip lies, and the terms of a step."""

from typing import Any, NamedTuple

# side of a row: 0 on the square mesh; -1 or 1 where the nearer column of the rows beside lies to the left or right.
LEVEL, LEFT, RIGHT = 0, -1, 1


class StripBounds(NamedTuple):
    """Begin and end of a strip, as in `Strip`; int64."""

    stride: int
    start: int
    inner: int
    outer: int
    stop: int


class Terms(NamedTuple):
    """Terms of a step, by the forms above: gains float32, arrays float32 of shape (J,). None is not computed.

    `total`: anything but None asks for the sum of u+. Compiled code names every one of them.
    """

    u_gain: Any
    u_old_gain: Any
    neighbour_gain: Any
    push: Any
    momentum: Any
    rho: Any
    eta: Any
    extra: Any
    extra_gain: Any
    total: Any
