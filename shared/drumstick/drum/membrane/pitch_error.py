"""Pitch error of a mesh's modes, from its scheme and its size. Any thread; quick."""

import math

from drumstick.drum.membrane.lattice import J01
from drumstick.drum.membrane.scheme import Scheme

# The error of the first twenty modes (each of a degenerate pair counts), root of the mean square, is a/N^2 + b/N^3
# cents on a mesh of N junctions across: dispersion falls as N^-2, the error of the rim as N^-3. In the fourth order it
# is (a + b/N)/N^3, more where effects leave less than the whole of tau; how junctions happen to lie beside the rim
# makes it up to a fifth more or less, below 24 across a third. Fitted to the
# eigenvalues of the kernel that plays; the tests hold them to it. Rounding adds to it where a mode's phase advance per
# step is small: a coefficient of the step lies between 1 and 2, so float32 knows it to half of 2^-23, and q = theta^2
# of the lowest mode, whose pitch is half of that, by as much. Higher modes are hardly affected, so this is their error
# relative to the lowest.
_LIMIT, _LOSSLESS, _SQUARE = (1165.0, 33700.0), (3800.0, 36000.0), (4060.0, 29600.0)
_TEXTBOOK_TAU, _LIMIT_TAU = 2.0, 8.0 / 3.0
_FOURTH, _FOURTH_TAU, _SQUEEZED = (24000.0, 80000.0), 2.514, 0.2
TWENTIETH = 9.936109524 / J01  # frequency of the twentieth mode over the lowest: the first zero of J_6
_ROUNDING_CENTS = 1200.0 / math.log(2.0) * 0.5 * 2.0**-24  # over theta^2


def rms_cents(scheme: Scheme, across: float) -> float:
    """Pitch error of the first twenty modes of a mesh so many junctions across, against an ideal membrane, in
    float32.
    """
    if scheme.order_4:
        less = 1.0 + _SQUEEZED * (_FOURTH_TAU - scheme.tau)
        a, b = 0.0, less * (_FOURTH[0] + _FOURTH[1] / across)
    elif not scheme.topology.shifted:
        a, b = _SQUARE
    else:  # straight in tau, also where effects leave room for less than tau = 2
        way = (scheme.tau - _TEXTBOOK_TAU) / (_LIMIT_TAU - _TEXTBOOK_TAU)
        a, b = ((1.0 - way) * one + way * other for one, other in zip(_LOSSLESS, _LIMIT, strict=True))
    theta = J01 * math.sqrt(scheme.tau) / across  # of the lowest mode
    return math.hypot(a / across**2 + b / across**3, _ROUNDING_CENTS / theta**2)
