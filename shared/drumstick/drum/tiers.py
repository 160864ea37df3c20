"""Tiers of accuracy: the order of the head's scheme, and how often a step is taken. Any thread."""

import math

from drumstick.drum.membrane.lattice import J01, TOPOLOGIES
from drumstick.drum.membrane.pitch_error import rms_cents
from drumstick.drum.membrane.scheme import Scheme, scheme_of
from drumstick.drum.membrane.step_coefficients import StepCoefficients
from drumstick.drum.modal.air_on_mesh import pitch_on_mesh
from drumstick.drum.step_numbers import coefficients_at
from drumstick.parameters.drum import Mesh
from drumstick.parameters.scene import Scene

_DIVISOR = {"draft": 4, "standard": 3, "fine": 2}
MIN_ACROSS = (
    24.0  # below this the pitch of the higher modes is off by more than 6 cents, or 3 by the fourth order
)
# The first twenty modes, rms, of `standard` and `fine`: the worst of them is then less than 4 cents off.
MOST_CENTS = 2.0
_MIN_BY_HAND = 8.0  # with a rate by hand; a mesh of fewer junctions across gets a higher rate
_MAX_DIVISOR = 12
# Junction updates that a core does in a second: 0.13 to 0.18 ns each were measured (docs/mesh.md).
_UPDATES_PER_S = 6e9


def takes_fourth(mesh: Mesh) -> bool:
    """True for a mesh that can be of fourth order, and whose tiers keep to MOST_CENTS: others are for comparison."""
    return mesh.topology == "triangular" and mesh.courant == "limit"


def _is_by_hand(mesh: Mesh) -> bool:
    return mesh.rate_Hz > 0.0 or mesh.junctions_across > 0.0


def order_of(scene: Scene, mesh_rate_Hz: float) -> int:
    """Order of the scheme in space and time: 4 for `fine`, and for `standard` where 2 is not true enough at this rate,
    unless that is by hand.
    """
    mesh = scene.mesh
    if mesh.accuracy == "fine":
        return 4
    if mesh.accuracy != "standard" or _is_by_hand(mesh) or not takes_fourth(mesh):
        return 2
    return 2 if _cents(scene, mesh_rate_Hz, 2) <= MOST_CENTS else 4


def _whole_scheme(scene: Scene, order: int) -> Scheme:
    # At its limit of stability, or as the scene says.
    topology = TOPOLOGIES[scene.mesh.topology]
    return scheme_of(topology, order, scene.mesh.courant == "lossless" and topology.shifted)


def scheme_at(scene: Scene, mesh_rate_Hz: float, order: int) -> Scheme:
    """Scheme as effects leave it; the whole of it where they leave nothing, and such a drum cannot be had."""
    whole = _whole_scheme(scene, order)
    try:
        scheme = coefficients_at(scene, 1.0 / mesh_rate_Hz, whole).scheme
    except (ValueError, ArithmeticError):
        return whole
    return scheme if scheme.tau > 0.0 else whole


def coefficients_of(scene: Scene, step_s: float) -> StepCoefficients:
    """Numbers of the first head, with a step every `step_s`."""
    return coefficients_at(scene, step_s, _whole_scheme(scene, order_of(scene, 1.0 / step_s)))


def junctions_across(scheme: Scheme, mesh_rate_Hz: float, f01_Hz: float) -> float:
    """Junctions across a head of this pitch, at this rate."""
    return J01 / math.pi * math.sqrt(scheme.tau) / 2.0 * mesh_rate_Hz / f01_Hz


def across_of(scene: Scene, mesh_rate_Hz: float) -> float:
    """Junctions across the head at this rate, without what effects take."""
    whole = _whole_scheme(scene, order_of(scene, mesh_rate_Hz))
    return junctions_across(whole, mesh_rate_Hz, pitch_on_mesh(scene.drum))


def _cents(scene: Scene, mesh_rate_Hz: float, order: int) -> float:
    scheme = scheme_at(scene, mesh_rate_Hz, order)
    return rms_cents(scheme, junctions_across(scheme, mesh_rate_Hz, pitch_on_mesh(scene.drum)))


def _is_true(scene: Scene, mesh_rate_Hz: float) -> bool:
    mesh = scene.mesh
    if mesh.accuracy == "draft" or _is_by_hand(mesh) or not takes_fourth(mesh):
        return True
    return _cents(scene, mesh_rate_Hz, order_of(scene, mesh_rate_Hz)) <= MOST_CENTS


def updates_per_s(scene: Scene, rate_Hz: int, divisor: int) -> float:
    """Junctions computed in a second."""
    across, height = across_of(scene, rate_Hz / divisor), TOPOLOGIES[scene.mesh.topology].row_height
    sweeps = 2.0 if order_of(scene, rate_Hz / divisor) == 4 else 1.0
    return math.pi / 4.0 * across**2 / height * rate_Hz / divisor * sweeps


def divisor_for(scene: Scene, rate_Hz: int) -> int:
    """Device samples per step of the mesh: what the scene's accuracy or rate asks for, within two limits.

    A high drum would have too few junctions across to be in tune (it gets a faster mesh, which is cheap there); a
    very low one would need more than one thread can compute (it gets a slower mesh, and loses overtones at the top).
    """
    divisor = _DIVISOR[scene.mesh.accuracy]
    fewest = MIN_ACROSS
    if scene.mesh.rate_Hz > 0.0:
        divisor = min(max(round(rate_Hz / scene.mesh.rate_Hz), 1), _MAX_DIVISOR)
        fewest = _MIN_BY_HAND
    if scene.mesh.junctions_across > 0.0:
        divisor = divisor if scene.mesh.rate_Hz > 0.0 else _MAX_DIVISOR
        fewest = scene.mesh.junctions_across
    most = scene.mesh.cpu_budget * _UPDATES_PER_S
    while divisor > 1 and (
        across_of(scene, rate_Hz / divisor) < fewest or not _is_true(scene, rate_Hz / divisor)
    ):
        divisor -= 1
    while divisor < _MAX_DIVISOR and updates_per_s(scene, rate_Hz, divisor) > most:
        divisor += 1
    return divisor
