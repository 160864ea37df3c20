"""A circular head struck by blows, solved exactly: a sum over the modes of an ideal membrane, in closed form.

It shares nothing with the drums that it judges, neither with the mesh nor with the bank of modes: numpy, and scipy's
Bessel functions. Mode (m, j) has the shape J_m(j r) cos(m phi) or sin(m phi), j a zero of J_m, and obeys, where the
tension is 1, q'' + 2 sigma q' + w0^2 q = c^2 F(t) shape(place) / norm (Morse, Ingard, "Theoretical acoustics", 5.2). Its
w0 are in the ratios of the zeros; the lowest mode sounds at f01, its decay included. All decay alike, or as a viscous
material with the square of w0. A blow's force is C e^(-a t) sin(w t + phi) while it lasts, a sum of two exponentials, so
what a mode does during and after it is known at every instant: there is no step. Any thread; allocates.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import special

_NEPERS = math.log(1000.0)  # 60 dB
_BLOCK = 64  # samples of a row of the matrix of phases
_ROUNDS = 60  # for the phase of a contact: it settles by itself
Numbers = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Place = tuple[float, float]  # radii


class Blow(NamedTuple):
    """Force C e^(-a t) sin(w t + phi) from t_s on, N, for lasts_s: (growth, size) of e^(growth t), the other half is its
    conjugate."""

    t_s: float
    place: Place
    lasts_s: float
    growth: complex
    size: complex


def blow(t_s: float, place: Place, lasts_s: float, impulse_N_s: float, contact: "Contact") -> Blow:
    """The blow of an isolated damped contact that lasts so long and gives this impulse."""
    a, b = contact.a_per_s, contact.b_per_s
    w, phase = math.pi / lasts_s, 0.0
    for _ in range(_ROUNDS):
        phase = math.atan2(2.0 * b * w, w * w + a * a - 2.0 * a * b)
        w = (math.pi if contact.pulls else math.pi - phase) / lasts_s
    growth, size = complex(-a, w), np.exp(1j * phase) / 2j
    whole = 2.0 * float((size * (np.exp(growth * lasts_s) - 1.0) / growth).real)
    return Blow(t_s, place, lasts_s, growth, complex(size * impulse_N_s / whole))


class Contact(NamedTuple):
    """Contact law of a stick: a = R_in/2m, b = (R_in - R_out)/2m, 1/s; and whether the head pulls at the end."""

    a_per_s: float
    b_per_s: float
    pulls: bool


class Head(NamedTuple):
    """Modes below a top, P of them without their pairs: orders, zeros, 1/norm, and poles -sigma + i w, 1/s."""

    orders: npt.NDArray[np.int64]
    zeros: Numbers
    inverse_norms: Numbers
    poles: Complex

    @property
    def f_Hz(self) -> Numbers:  # noqa: N802
        """Pitch of each mode."""
        return self.poles.imag / (2.0 * math.pi)

    @property
    def t60_s(self) -> Numbers:
        """Time in which each falls by 60 dB."""
        return -_NEPERS / self.poles.real


def _zeros(order: int, count: int) -> list[float]:
    found: Any = special
    return found.jn_zeros(order, count).tolist()


def head(f01_Hz: float, t60_s: float, top_Hz: float, high: tuple[float, float] | None = None) -> Head:
    """The head whose lowest mode sounds at f01_Hz and falls by 60 dB in t60_s. high: (t60_s, Hz) of a mode up there,
    where losses rise with the square of the frequency; None: all decay alike."""
    lowest = float(_zeros(0, 1)[0])
    most = lowest * top_Hz / f01_Hz
    found: list[tuple[float, int]] = []
    for order in range(math.ceil(most)):
        own = _zeros(order, max(1, math.ceil((most - order) / math.pi) + 1))
        found += [(zero, order) for zero in own if zero <= most]
    found.sort()
    zeros, orders = np.array([zero for zero, _ in found]), np.array([order for _, order in found])
    norms = math.pi * special.jv(orders + 1, zeros) ** 2 * np.where(orders == 0, 1.0, 0.5)
    per_s, rise = _NEPERS / t60_s, 0.0
    w01 = math.hypot(2.0 * math.pi * f01_Hz, per_s)  # undamped
    if high is not None:
        w_high = math.hypot(2.0 * math.pi * high[1], _NEPERS / high[0])
        rise = (_NEPERS / high[0] - per_s) / (w_high**2 - w01**2)
    w0_squared = (w01 * zeros / lowest) ** 2
    sigma = per_s + rise * (w0_squared - w01**2)
    return Head(orders, zeros, 1.0 / norms, -sigma + 1j * np.sqrt(w0_squared - sigma**2))


def _shapes(of: Head, place: Place) -> Numbers:
    # (2, P), cos and sin.
    radial = special.jv(of.orders, of.zeros * math.hypot(*place))
    angle = of.orders * math.atan2(place[1], place[0])
    return np.array([radial * np.cos(angle), radial * np.sin(angle)])


class _Ringing:
    # Samples of Im(sum of weights e^(pole (t - t_s))): a product of two matrices of phases.
    def __init__(self, poles: Complex, rate_Hz: float) -> None:
        self._poles, self._rate_Hz = poles, rate_Hz
        self._within = np.exp(np.outer(np.arange(_BLOCK), poles / rate_Hz))
        self._onward = np.exp(_BLOCK * poles / rate_Hz)

    def add(self, out: Numbers, weights: Complex, t_s: float, until_s: float) -> None:
        first, last = (min(math.ceil(each * self._rate_Hz - 1e-9), len(out)) for each in (t_s, until_s))
        if first >= last:
            return
        blocks = np.empty((math.ceil((last - first) / _BLOCK), len(weights)), np.complex128)
        blocks[0] = weights * np.exp(self._poles * (first / self._rate_Hz - t_s))
        for at in range(1, len(blocks)):
            blocks[at] = blocks[at - 1] * self._onward
        out[first:last] += (blocks @ self._within.T).imag.ravel()[: last - first]


def velocity(
    of: Head, blows: Sequence[Blow], pickups: Iterable[tuple[float, Place]], duration_s: float, rate_Hz: float
) -> Numbers:
    """Velocity of the head at its pickups, each by its gain, in all: shape (n,), up to one factor.

    Contacts may overlap. Sampled at k / rate_Hz; nothing is filtered, so keep the head's top below half the rate.
    """
    heard = sum((gain * _shapes(of, place) for gain, place in pickups), np.zeros((2, len(of.zeros))))
    # Velocity of a mode that has gathered A = int F e^(pole (t - s)) ds is Im(pole A) / w.
    heard = heard * of.inverse_norms * (of.poles / of.poles.imag)
    out = np.zeros(round(duration_s * rate_Hz))
    ringing = _Ringing(of.poles, rate_Hz)
    gathered: Any = np.zeros((2, len(of.zeros)), np.complex128)
    ends = sorted(blows, key=lambda each: each.t_s + each.lasts_s)
    places = {each.place: _shapes(of, each.place) for each in ends}
    before_s = 0.0
    for at, each in enumerate(ends):
        end_s = each.t_s + each.lasts_s
        gathered = gathered * np.exp(of.poles * (end_s - before_s))
        own = (heard * places[each.place]).sum(axis=0)
        left = np.zeros(len(of.zeros), np.complex128)
        for growth, size in ((each.growth, each.size), (each.growth.conjugate(), each.size.conjugate())):
            share = size / (of.poles - growth)
            ringing.add(out, own * share, each.t_s, end_s)
            k = np.arange(
                math.ceil(each.t_s * rate_Hz - 1e-9), min(math.ceil(end_s * rate_Hz - 1e-9), len(out))
            )
            out[k] -= ((own * share).sum() * np.exp(growth * (k / rate_Hz - each.t_s))).imag
            left += share * (np.exp(of.poles * each.lasts_s) - np.exp(growth * each.lasts_s))
        gathered += left * places[each.place]
        until_s = ends[at + 1].t_s + ends[at + 1].lasts_s if at + 1 < len(ends) else math.inf
        ringing.add(out, (heard * gathered).sum(axis=0), end_s, min(until_s, duration_s))
        before_s = end_s
    return out
