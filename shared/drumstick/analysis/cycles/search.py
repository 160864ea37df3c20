"""Fixed points of the return map: every speed v_out that one return, or two, bring back.

The mismatch is scanned over v_out on a logarithmic grid. A change of sign between two nodes, a dip of its modulus that
reaches through zero, and the last speed before returns end otherwise (capture, flight for ever) each give a bracket,
and a bracket is narrowed to the last digit. The map jumps where a contact is only just missed or only just ends: a
change of sign there is no fixed point, and the caller, who polishes what is found, throws it out.

For two returns the mismatch is divided by that of one return, so that fixed points of one return do not show up again.
Any thread; blocks for some tenths of a second; the work is bounded.
"""

import math
from collections.abc import Iterator

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.return_map import OF_V_OUT, ReturnMap
from drumstick.analysis.cycles.return_step import V_IN, V_OUT, Numbers
from realtime.records import Records

# Below _FLAT a mismatch is rounding. So it is in a contact much slower than the speed at which the hand's pressing
# alone would swing the stick into the head: what it moves is lost in the digits of where the hand holds it, and the
# error grows with the square of that ratio. Where the mismatch stays zero from node to node nothing is lost: every
# speed repeats.
_FLAT, _ROUNDING, _BLIND = 1e-12, 2e-15, 1e-3
# In events, for one search: some seconds of computing at most. A scan that would take more than half of it goes in
# larger strides.
_MAX_EFFORT, _SCAN_EFFORT, _STRIDE = 110_000.0, 70_000.0, 16
_MAX_FOUND = 64
_EDGE_HALVINGS = 45
_DIP_STEPS = 24
_ROOT_STEPS = 100
_GOLDEN = 0.3819660112501051

# Two places x, the logarithm of v_out, between which the mismatch changes sign, and its sign at the first.
Bracket = tuple[float, float, float]


class Search:
    """The mismatch of `returns` (1 or 2) over x, the logarithm of v_out; NaN where returns end otherwise."""

    def __init__(self, law: Records, scratch: Records, returns: int) -> None:
        self._once = ReturnMap(law, scratch, 1, return_step.FEW_WAIT_DOUBLINGS)
        self._twice = ReturnMap(law, scratch, 2, return_step.FEW_WAIT_DOUBLINGS) if returns == 2 else None
        m, k_hand, k_coll, z_ss = (float(law[name][0]) for name in ("m", "k_hand", "k_coll", "z_ss"))
        self._pressing = k_hand * abs(z_ss) / math.sqrt(m * (k_hand + k_coll))

    def found(self, x: Numbers) -> list[Numbers]:
        """Candidate states, shape (5,), that the returns bring back; x: the nodes to scan, increasing."""
        f, stride = self._scan(x)
        states: list[Numbers] = []
        for first, second, sign in self._brackets(x[::stride], f[::stride]):
            root = self._root(first, second, sign)
            if not math.isnan(root) and not math.isnan(self.mismatch(root)):
                states.append((self._twice or self._once).start.copy())
            if len(states) >= _MAX_FOUND:
                break
        return states

    def mismatch(self, x: float) -> float:
        """v_out after the returns over v_out before, minus 1; for two returns divided by that for one."""
        speed = math.exp(x)
        if self._twice is None:
            return self._rest(self._once, speed)
        of_two = self._rest(self._twice, speed)
        if not abs(of_two) > 0.0:
            return of_two
        of_one = self._rest(self._once, speed)
        return of_two / of_one if abs(of_one) > 0.0 else of_two

    def _effort(self) -> float:
        return self._once.effort + (self._twice.effort if self._twice else 0.0)

    def _rest(self, mapped: ReturnMap, speed: float) -> float:
        if self._effort() > _MAX_EFFORT or not mapped.at(speed, OF_V_OUT):
            return math.nan
        rest = float(mapped.states[-1, V_OUT]) / speed - 1.0
        blur = _FLAT + _ROUNDING * (self._pressing / float(np.abs(mapped.measured[:, V_IN]).min())) ** 2
        if blur > _BLIND:
            return math.nan
        return rest if abs(rest) > blur else 0.0

    def _scan(self, x: Numbers) -> tuple[Numbers, int]:
        # The mismatch at every 16th node, then between them, down to the stride that the effort allows.
        f = np.full(len(x), np.nan)
        stride, first, step = _STRIDE, 0, _STRIDE
        while True:
            self._once.forget()
            if self._twice:
                self._twice.forget()
            for i in range(first, len(x), step):
                if stride < _STRIDE and self._effort() > _SCAN_EFFORT:
                    return f, 2 * stride
                f[i] = self.mismatch(float(x[i]))
            if stride == 1:
                return f, 1
            first, step, stride = stride // 2, stride, stride // 2

    def _brackets(self, x: Numbers, f: Numbers) -> Iterator[Bracket]:
        for i in range(1, len(x)):
            a, b, fa, fb = float(x[i - 1]), float(x[i]), float(f[i - 1]), float(f[i])
            if math.isnan(fa) and math.isnan(fb):
                continue
            if math.isnan(fa) or math.isnan(fb):
                a, b, fa = (b, a, fb) if math.isnan(fa) else (a, b, fa)
                b = self._edge(a, b)
                fb = self.mismatch(b)
            after = float(f[i + 1]) if i + 1 < len(x) else math.nan
            if fb == 0.0 and fa != 0.0 and after != 0.0:
                yield b, b, fa
            elif fa * fb < 0.0:
                yield a, b, fa
            elif fa * fb > 0.0 and fb * after > 0.0 and _is_dip(fa, fb, after):
                dip = self._dip(a, float(x[i + 1]), fb)
                if not math.isnan(dip):
                    yield a, dip, fa
                    yield float(x[i + 1]), dip, fa

    def _edge(self, inside: float, outside: float) -> float:
        # The last x at which returns still come round, between one at which they do and one at which they do not.
        for _ in range(_EDGE_HALVINGS):
            middle = 0.5 * (inside + outside)
            if math.isnan(self.mismatch(middle)):
                outside = middle
            else:
                inside = middle
        return inside

    def _dip(self, low: float, high: float, sign: float) -> float:
        # Golden section towards the smallest modulus: the first x at which the sign has changed, else NaN.
        sign = math.copysign(1.0, sign)
        near, far = low + _GOLDEN * (high - low), high - _GOLDEN * (high - low)
        f_near, f_far = sign * self.mismatch(near), sign * self.mismatch(far)
        for _ in range(_DIP_STEPS):
            if f_near < 0.0:
                return near
            if f_far < 0.0:
                return far
            if f_near < f_far:
                high, far, f_far = far, near, f_near
                near = low + _GOLDEN * (high - low)
                f_near = sign * self.mismatch(near)
            else:
                low, near, f_near = near, far, f_far
                far = high - _GOLDEN * (high - low)
                f_far = sign * self.mismatch(far)
        return math.nan

    def _root(self, a: float, b: float, fa: float) -> float:
        # Two secant steps, then a halving, and again; NaN when returns end otherwise in between.
        if a == b:
            return b
        fb = self.mismatch(b)
        for step in range(_ROOT_STEPS):
            if abs(b - a) <= 2e-16 * max(1.0, abs(a)):
                break
            x = 0.5 * (a + b)
            if step % 3 != 0 and fb != fa:
                secant = b - fb * (b - a) / (fb - fa)
                x = secant if min(a, b) < secant < max(a, b) else x
            f = self.mismatch(x)
            if math.isnan(f):
                return math.nan
            if f == 0.0:
                return x
            if (f > 0.0) == (fa > 0.0):
                a, fa = x, f
            else:
                b, fb = x, f
        return b


def _is_dip(before: float, here: float, after: float) -> bool:
    # Could a parabola through three nodes of one sign touch zero between them? Twice as generous as that; rounding on a
    # flat stretch is not enough.
    bent = abs(before + after - 2.0 * here)
    return abs(here) < abs(before) and abs(here) <= abs(after) and abs(here) <= 0.25 * bent
