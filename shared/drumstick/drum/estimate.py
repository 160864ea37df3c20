"""Estimated cost and accuracy of the scene's drum at each accuracy, without a trial. Any thread; quick."""

import dataclasses
import math
from typing import Any, Literal, NamedTuple

from drumstick.drum import tiers
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.membrane.scheme import Scheme
from drumstick.drum.step_numbers import coefficients_of
from drumstick.parameters.drum import Mesh
from drumstick.parameters.scene import Scene

ACCURACIES: tuple[Literal["draft", "standard", "fine"], ...] = ("draft", "standard", "fine")
# The error of the first twenty modes (each of a degenerate pair counts), root of the mean square, is a/N^2 + b/N^3
# cents on a mesh of N junctions across: dispersion falls as N^-2, the error of the rim as N^-3. Fitted to the
# eigenvalues of the kernel that plays; the tests hold them to it. Rounding adds to it where a mode's phase advance per
# step is small: a coefficient of the step lies between 1 and 2, so float32 knows it to half of 2^-23, and q = theta^2
# of the lowest mode, whose pitch is half of that, by as much. Higher modes are hardly affected, so this is their error
# relative to the lowest.
_LIMIT, _LOSSLESS, _SQUARE, _FOURTH = (1165.0, 33700.0), (3800.0, 36000.0), (4060.0, 29600.0), (0.0, 26500.0)
_TEXTBOOK_TAU, _LIMIT_TAU = 2.0, 8.0 / 3.0
_ROUNDING_CENTS = 1200.0 / math.log(2.0) * 0.5 * 2.0**-24  # over theta^2
_BY_NAME: dict[str, Any] = {"rate_Hz": 0.0, "junctions_across": 0.0, "cpu_budget": Mesh().cpu_budget}


class Estimate(NamedTuple):
    """One accuracy. updates_per_s: of junctions; cents: rms error of the first twenty modes, the lowest in tune."""

    accuracy: str
    mesh_rate_Hz: float
    across: float
    updates_per_s: float
    cents: float


def rms_cents(scheme: Scheme, across: float) -> float:
    """Pitch error of the first twenty modes of a mesh so many junctions across, against an ideal membrane, in
    float32.
    """
    if scheme.order_4:
        a, b = _FOURTH
    elif not scheme.topology.shifted:
        a, b = _SQUARE
    else:  # straight in tau, also where effects leave room for less than tau = 2
        way = (scheme.tau - _TEXTBOOK_TAU) / (_LIMIT_TAU - _TEXTBOOK_TAU)
        a, b = ((1.0 - way) * one + way * other for one, other in zip(_LOSSLESS, _LIMIT, strict=True))
    theta = J01 * math.sqrt(scheme.tau) / across  # of the lowest mode
    return math.hypot(a / across**2 + b / across**3, _ROUNDING_CENTS / theta**2)


def estimates(scene: Scene, rate_Hz: int) -> list[Estimate]:
    """First of the scene's own mesh as "now", then of draft, standard and fine."""
    own = dataclasses.replace(scene, modal=None)
    tried = {"now": own} | {
        name: dataclasses.replace(own, mesh=dataclasses.replace(own.mesh, **_BY_NAME, accuracy=name))
        for name in ACCURACIES
    }
    return [of(name, at, rate_Hz) for name, at in tried.items()]


def _squeezed(scene: Scene, step_s: float) -> Scheme:
    # What effects leave of the scheme; the whole of it where they leave nothing, and such a drum cannot be had.
    try:
        scheme = coefficients_of(scene, step_s).scheme
    except (ValueError, ArithmeticError):
        return tiers.scheme_for(scene)
    return scheme if scheme.tau > 0.0 else tiers.scheme_for(scene)


def of(name: str, scene: Scene, rate_Hz: int) -> Estimate:
    """Estimate the scene's mesh, under this name."""
    divisor = tiers.divisor_for(scene, rate_Hz)
    scheme = _squeezed(scene, divisor / rate_Hz)
    narrower = math.sqrt(scheme.tau / tiers.scheme_for(scene).tau)  # effects take from the room for a wave
    across = narrower * tiers.across_of(scene, rate_Hz / divisor)
    updates_per_s = narrower**2 * tiers.updates_per_s(scene, rate_Hz, divisor)
    return Estimate(name, rate_Hz / divisor, across, updates_per_s, rms_cents(scheme, across))
