"""Tiers of accuracy: the order of the head's scheme, and how often a step is taken. Any thread."""

import math

from drumstick.drum.effects.registry import SECOND_ORDER_ONLY
from drumstick.drum.membrane.lattice import J01, TOPOLOGIES
from drumstick.drum.membrane.scheme import Scheme, scheme_of
from drumstick.drum.modal.air_on_mesh import pitch_on_mesh
from drumstick.parameters.scene import Scene

_DIVISOR = {"draft": 4, "standard": 3, "fine": 2}
MIN_ACROSS = 24.0  # below this the pitch of the higher modes is off by more than 8 cents
_MIN_BY_HAND = 8.0  # with a rate by hand; a mesh of fewer junctions across gets a higher rate
_MAX_DIVISOR = 12
# Junction updates that a core does in a second: 0.13 to 0.18 ns each were measured (docs/mesh.md).
_UPDATES_PER_S = 6e9


def order_of(scene: Scene) -> int:
    """Order of the scheme in space and time: 4 for `fine`, where the drum's effects allow it."""
    fourth = scene.mesh.accuracy == "fine" and scene.mesh.topology == "triangular"
    return 4 if fourth and not any(name in scene.drum.effects for name in SECOND_ORDER_ONLY) else 2


def why_second_order(scene: Scene) -> str:
    """Words for what keeps a mesh that should be `fine` in second order; empty where nothing does."""
    if scene.modal is not None or scene.mesh.accuracy != "fine" or order_of(scene) == 4:
        return ""
    shaped = [] if scene.mesh.topology == "triangular" else [f"a {scene.mesh.topology} mesh"]
    named = [*shaped, *(name for name in SECOND_ORDER_ONLY if name in scene.drum.effects)]
    return f"fine at second order only: the fourth-order scheme does not work with {', '.join(named)}"


def across_of(scene: Scene, mesh_rate_Hz: float) -> float:
    """Junctions across the head at this rate."""
    scheme = scheme_for(scene)
    return J01 / math.pi * math.sqrt(scheme.tau) / 2.0 * mesh_rate_Hz / pitch_on_mesh(scene.drum)


def scheme_for(scene: Scene) -> Scheme:
    """The scheme at its limit of stability, or as the scene says."""
    topology = TOPOLOGIES[scene.mesh.topology]
    return scheme_of(topology, order_of(scene), scene.mesh.courant == "lossless" and topology.shifted)


def updates_per_s(scene: Scene, rate_Hz: int, divisor: int) -> float:
    """Junctions computed in a second."""
    junctions = (
        math.pi / 4.0 * across_of(scene, rate_Hz / divisor) ** 2 / TOPOLOGIES[scene.mesh.topology].row_height
    )
    return junctions * rate_Hz / divisor * (2.0 if order_of(scene) == 4 else 1.0)


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
    while divisor > 1 and across_of(scene, rate_Hz / divisor) < fewest:
        divisor -= 1
    while divisor < _MAX_DIVISOR and updates_per_s(scene, rate_Hz, divisor) > most:
        divisor += 1
    return divisor
