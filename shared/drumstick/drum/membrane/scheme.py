"""The time step: its limit of stability, losses, and the grid spacing that tunes the lowest mode.

With A u = (mean of the neighbours, weighted at the rim) - u, which is h^2/4 times the Laplacian, a step is

    (1 + s) u+ = 2 u - (1 - s) u- + tau A u + order_4 A A u                     every mode loses alike (s)
    p' = rho p + tau A u,   u+ = u + p' + eta tau A u                           high modes lose more (eta)

A mode with A u = -a u, 0 <= a <= max_eigenvalue, advances by the phase theta per step; q = tau a - order_4 a^2 fixes
it, and with momentum tau A u above is tau A u + order_4 A A u as well. Up to q = 2 (1 + rho)/(1 + eta (1 + rho)) all
is stable, 4 without losses. tau = 4 (c T/h)^2: 2 is the textbook's lossless triangular mesh (Fontana and Rocchesso,
"Online correction of dispersion error in 2D waveguide meshes", ICMC 2000); the limit 8/3 has a third of its phase
error.
"""

import math
from dataclasses import dataclass

from drumstick.drum.membrane.lattice import J01, Lattice, Topology, lattice_of, lowest_eigenvalue

_NEPERS = 3.0 * math.log(10.0)  # 60 dB
_SETTLED = 40
_TUNINGS = 3


@dataclass(frozen=True)
class Scheme:
    """A way to take a step. `tau` as above; `order_4` is 0 for the usual, second order."""

    topology: Topology
    tau: float
    order_4: float = 0.0

    def squeezed(self, most: float, rise: float = 0.0) -> "Scheme":
        """This scheme with a shorter way of the wave in a step, where needed, so that q <= `most`, also with tau A u
        larger by `rise` of itself.
        """
        if self.order_4:
            return _fourth(self.topology, min(self.tau / 4.0, _largest_fourth(most, rise)))
        return Scheme(self.topology, min(self.tau, most / (1.0 + rise) / self.topology.max_eigenvalue))

    def eigenvalue_of(self, q: float) -> float:
        """a, from q."""
        if self.order_4 == 0.0:
            return q / self.tau
        return 2.0 * q / (self.tau + math.sqrt(self.tau**2 - 4.0 * self.order_4 * q))


def _largest_fourth(most: float, rise: float) -> float:
    # The largest x = (c T/h)^2 with q <= most, from 6 (1 + rise) x - 36 (x^2/12 - x/16) = most; a hair less.
    half = 8.25 + 6.0 * rise
    return (half - math.sqrt(half**2 - 12.0 * most)) / 6.0 * (1.0 - 1e-6)


def _fourth(topology: Topology, x: float) -> Scheme:
    return Scheme(topology, 4.0 * x, 4.0 * x**2 / 3.0 - x)


def scheme_of(topology: Topology, order: int, lossless: bool) -> Scheme:
    """The scheme at its limit of stability, or the textbook's with tau = 2 (`lossless`). order: 2 or 4.

    ValueError for a fourth order on the square mesh, which is not as true in all directions, or of the textbook's.
    """
    if order == 4:
        if lossless or not topology.shifted:
            raise ValueError("fourth order needs the triangular mesh at its limit of stability")
        return _fourth(topology, _largest_fourth(4.0, 0.0))
    return Scheme(topology, 2.0 if lossless else 4.0 / topology.max_eigenvalue)


@dataclass(frozen=True)
class Losses:
    """Losses of each step. `s` for all alike; or, when `eta` > 0, rho and eta."""

    s: float
    rho: float = 1.0
    eta: float = 0.0

    @property
    def most(self) -> float:
        """The largest stable q: at it a root of z^2 - (1 + rho - (1 + eta) q) z + rho (1 - eta q) is -1."""
        return 2.0 * (1.0 + self.rho) / (1.0 + self.eta * (1.0 + self.rho))

    def q_of(self, theta: float) -> float:
        """q of the mode that advances by the phase theta per step. ValueError where nothing is left of it after one."""
        if self.eta == 0.0:
            return 2.0 - 2.0 * math.cos(theta) * math.sqrt(1.0 - self.s**2)
        q = 2.0 - 2.0 * math.cos(theta)
        for _ in range(_SETTLED):
            left = self.rho * (1.0 - self.eta * q)
            if not left >= 0.0:
                raise ValueError("the losses leave nothing of a wave after one step")
            q = (1.0 + self.rho - 2.0 * math.cos(theta) * math.sqrt(left)) / (1.0 + self.eta)
        return q

    def t60_s(self, theta: float, step_s: float) -> float:
        """Time in which a mode that advances by theta per step falls by 60 dB; infinite without losses."""
        left = (
            (1.0 - self.s) / (1.0 + self.s)
            if self.eta == 0.0
            else self.rho * (1.0 - self.eta * self.q_of(theta))
        )
        return -2.0 * _NEPERS * step_s / math.log(left) if left < 1.0 else math.inf


def _left(t60_s: float, step_s: float) -> float:
    # Of the energy, after a step.
    return math.exp(-2.0 * _NEPERS * step_s / t60_s) if math.isfinite(t60_s) else 1.0


def even_losses(t60_s: float, step_s: float) -> Losses:
    """All modes fall by 60 dB in t60_s; without losses for an infinite one."""
    left = _left(t60_s, step_s)
    return Losses((1.0 - left) / (1.0 + left))


def rising_losses(t60_s: float, f_Hz: float, high_t60_s: float, high_Hz: float, step_s: float) -> Losses:
    """The mode at f_Hz falls by 60 dB in t60_s, the one at high_Hz in high_t60_s, between them as a viscous material.

    Such a material loses with the square of the frequency (Kelvin-Voigt). ValueError unless high_t60_s < t60_s and
    f_Hz < high_Hz. A frequency that the mesh does not reach gives the same law.
    """
    if not (high_t60_s < t60_s and f_Hz < high_Hz):
        raise ValueError(f"{high_t60_s:g} s at {high_Hz:g} Hz must be less than {t60_s:g} s at {f_Hz:g} Hz")
    rise = (1.0 / high_t60_s - 1.0 / t60_s) / (high_Hz**2 - f_Hz**2)
    at_Hz = min(high_Hz, 0.1 / step_s)
    wanted = 1.0 / (1.0 / t60_s + rise * (at_Hz**2 - f_Hz**2))
    low, high = (2.0 * math.pi * f * step_s for f in (f_Hz, at_Hz))
    losses = Losses(0.0, _left(t60_s, step_s), 1e-12)
    for _ in range(_SETTLED):  # q hardly depends on the losses
        q_low, q_high = losses.q_of(low), losses.q_of(high)
        ratio = _left(wanted, step_s) / _left(t60_s, step_s)
        eta = (1.0 - ratio) / (q_high - ratio * q_low)
        losses = Losses(0.0, _left(t60_s, step_s) / (1.0 - eta * q_low), eta)
    return losses


def tuned(f01_Hz: float, step_s: float, scheme: Scheme, losses: Losses) -> Lattice:
    """The lattice on which the lowest mode sounds at f01: the mesh's own dispersion and its rim are taken out.

    ValueError where no lattice has so low a mode.
    """
    a = scheme.eigenvalue_of(losses.q_of(2.0 * math.pi * f01_Hz * step_s))
    if not a > 0.0:
        raise ValueError("nothing is left of the stiffness of the lowest mode")
    lattice = lattice_of(2.0 * math.sqrt(a) / J01, scheme.topology)
    for _ in range(_TUNINGS):
        lattice = lattice_of(lattice.spacing * math.sqrt(a / lowest_eigenvalue(lattice)), scheme.topology)
    return lattice
