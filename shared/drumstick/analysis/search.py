"""Where the return map meets itself: every speed v_out that one lap, or two, bring back.

The mismatch is scanned over v_out on a logarithmic grid. A change of sign between two nodes, a dip of its modulus that
reaches through zero, and the last speed before laps end otherwise (capture, flight without return) each give a bracket,
and a bracket is narrowed to the last digit. The map jumps where a contact is only just missed or only just ends: a
change of sign there is no fixed point, and the caller, who polishes what is found, throws it out.

For two laps the mismatch is divided by that of one lap, so that fixed points of one lap do not show up again.
Kernels: any thread; the number of laps is bounded.
"""

import math

import numpy as np

from drumstick import exact
from drumstick.analysis import lap
from drumstick.analysis.lap import V_OUT, Numbers
from drumstick.analysis.return_map import OF_V_OUT, from_guess, guess
from realtime.jit import Record, Records, njit

MOST_FOUND = 64
# Below this a mismatch is rounding. Where it stays so from node to node nothing is lost and every speed repeats.
_FLAT = 1e-12
# In events, for one and for two laps: some seconds of computing. A scan that would take more than half of it goes in
# larger strides.
_MOST_EFFORT, _SCAN_EFFORT, _STRIDE = 300_000.0, 150_000.0, 16
_EDGE_HALVINGS = 45
_DIP_STEPS = 24
_ROOT_STEPS = 100
_GOLDEN = 0.3819660112501051

# What one evaluation works on: the states before and after (5,), and what the laps told (laps, 6).
Work = tuple[Numbers, Numbers, Numbers]


@njit()
def _mismatch(law: Record, scratch: Records, speed: float, work: Work) -> float:
    start, end, told = work
    if told[:, lap.EFFORT].sum() > _MOST_EFFORT:
        return math.nan
    if from_guess(law, scratch, speed, OF_V_OUT, start, end, told, lap.LITTLE_PATIENCE) != exact.MOVING:
        return math.nan
    rest = end[V_OUT] / speed - 1.0
    return rest if abs(rest) > _FLAT else 0.0


@njit()
def _value(law: Record, scratch: Records, x: float, once: Work, twice: Work, laps: int) -> float:
    # The scanned function at v_out = exp(x).
    speed = math.exp(x)
    if laps == 1:
        return _mismatch(law, scratch, speed, once)
    of_two = _mismatch(law, scratch, speed, twice)
    if not abs(of_two) > 0.0:
        return of_two
    of_one = _mismatch(law, scratch, speed, once)
    return of_two / of_one if abs(of_one) > 0.0 else of_two


@njit()
def _root(
    law: Record, scratch: Records, a: float, b: float, fa: float, once: Work, twice: Work, laps: int
) -> float:
    # Bisection, with a secant step (Illinois) every other time while that helps; NaN when laps end otherwise between.
    fb = _value(law, scratch, b, once, twice, laps)
    for step in range(_ROOT_STEPS):
        if abs(b - a) <= 2e-16 * max(1.0, abs(a)):
            break
        middle = 0.5 * (a + b)
        if step % 3 != 0 and fb != fa:
            secant = b - fb * (b - a) / (fb - fa)
            inside = min(a, b) < secant < max(a, b)
            middle = secant if inside else middle
        f = _value(law, scratch, middle, once, twice, laps)
        if math.isnan(f):
            return math.nan
        if f == 0.0:
            return middle
        if (f > 0.0) == (fa > 0.0):
            a, fa = middle, f
        else:
            b, fb = middle, f
    return b


@njit()
def _edge(
    law: Record, scratch: Records, inside: float, outside: float, once: Work, twice: Work, laps: int
) -> float:
    # The last x at which laps still come round, between one at which they do and one at which they do not.
    for _ in range(_EDGE_HALVINGS):
        middle = 0.5 * (inside + outside)
        if math.isnan(_value(law, scratch, middle, once, twice, laps)):
            outside = middle
        else:
            inside = middle
    return inside


@njit()
def _dip(
    law: Record, scratch: Records, low: float, high: float, sign: float, once: Work, twice: Work, laps: int
) -> float:
    # Golden section towards the smallest value times sign: the first x at which that is below 0, else NaN.
    width = high - low
    near, far = low + _GOLDEN * width, high - _GOLDEN * width
    f_near = sign * _value(law, scratch, near, once, twice, laps)
    f_far = sign * _value(law, scratch, far, once, twice, laps)
    for _ in range(_DIP_STEPS):
        if f_near < 0.0:
            return near
        if f_far < 0.0:
            return far
        if f_near < f_far:
            high, far, f_far = far, near, f_near
            near = low + _GOLDEN * (high - low)
            f_near = sign * _value(law, scratch, near, once, twice, laps)
        else:
            low, near, f_near = near, far, f_far
            far = high - _GOLDEN * (high - low)
            f_far = sign * _value(law, scratch, far, once, twice, laps)
    return math.nan


@njit()
def _keep(law: Record, scratch: Records, x: float, work: Work, found: Numbers, count: int) -> int:
    # Store the self-consistent state at this speed; returns how many there are now.
    if math.isnan(x) or count >= found.shape[0]:
        return count
    if math.isnan(_mismatch(law, scratch, math.exp(x), work)):
        return count
    found[count] = work[0]
    return count + 1


@njit()
def _scan(law: Record, scratch: Records, x: Numbers, once: Work, twice: Work, laps: int, f: Numbers) -> int:
    # Fill f at every 16th node, then between them, down to the stride that the effort allows; returns that.
    stride = _STRIDE
    first, step = 0, stride
    while True:
        guess(law, math.exp(x[0]), once[0])
        guess(law, math.exp(x[0]), twice[0])
        for i in range(first, x.shape[0], step):
            if (
                twice[2][:, lap.EFFORT].sum() + once[2][:, lap.EFFORT].sum() > _SCAN_EFFORT
                and stride < _STRIDE
            ):
                return 2 * stride
            f[i] = _value(law, scratch, x[i], once, twice, laps)
        if stride == 1:
            return 1
        first, step, stride = stride // 2, stride, stride // 2


@njit()
def _is_dip(before: float, here: float, after: float) -> bool:
    # Could a parabola through three nodes of one sign touch zero between them? Twice as generous as that; rounding on a
    # flat stretch is not enough.
    bent = abs(before + after - 2.0 * here)
    return abs(here) < abs(before) and abs(here) <= abs(after) and abs(here) <= 0.25 * bent


@njit()
def find(law: Record, scratch: Records, x: Numbers, laps: int, found: Numbers) -> int:
    """Fill `found`, shape (n, 5), with candidate states that `laps` (1 or 2) bring back; returns how many.

    x: the logarithms of the speeds v_out to scan, increasing. scratch: shape (2,), a motion to work on, a fresh one.
    """
    state = lap.STATE_SIZE
    once = (np.zeros(state), np.zeros(state), np.zeros((1, lap.TOLD_SIZE)))
    twice = (np.zeros(state), np.zeros(state), np.zeros((2, lap.TOLD_SIZE)))
    work = once if laps == 1 else twice
    f = np.zeros(x.shape[0])
    stride = _scan(law, scratch, x, once, twice, laps, f)
    count = 0
    for i in range(stride, x.shape[0], stride):
        a, b, fa, fb = x[i - stride], x[i], f[i - stride], f[i]
        f_next = f[i + stride] if i + stride < x.shape[0] else math.nan
        if math.isnan(fa) != math.isnan(fb):
            if math.isnan(fa):
                a, b, fa = b, a, fb
            b = _edge(law, scratch, a, b, once, twice, laps)
            fb = _value(law, scratch, b, once, twice, laps)
        if fb == 0.0 and fa != 0.0 and f_next != 0.0:
            count = _keep(law, scratch, b, work, found, count)
        elif fa * fb < 0.0:
            root = _root(law, scratch, a, b, fa, once, twice, laps)
            count = _keep(law, scratch, root, work, found, count)
        elif fa * fb > 0.0 and fb * f_next > 0.0 and _is_dip(fa, fb, f_next):
            sign = 1.0 if fb > 0.0 else -1.0
            after = x[i + stride]
            dip = _dip(law, scratch, a, after, sign, once, twice, laps)
            if not math.isnan(dip):
                for side in (a, after):
                    root = _root(law, scratch, side, dip, sign, once, twice, laps)
                    count = _keep(law, scratch, root, work, found, count)
    return count
