"""Estimated cost and accuracy of the scene's drum at each accuracy, without a trial. Any thread; quick."""

import dataclasses
from typing import Any, Literal, NamedTuple

from drumstick.drum import tiers
from drumstick.drum.membrane.pitch_error import rms_cents
from drumstick.parameters.drum import Mesh
from drumstick.parameters.scene import Scene

ACCURACIES: tuple[Literal["draft", "standard", "fine"], ...] = ("draft", "standard", "fine")
_BY_NAME: dict[str, Any] = {"rate_Hz": 0.0, "junctions_across": 0.0, "cpu_budget": Mesh().cpu_budget}


class Estimate(NamedTuple):
    """One accuracy. updates_per_s: of junctions; cents: rms error of the first twenty modes, the lowest in tune."""

    accuracy: str
    mesh_rate_Hz: float
    across: float
    updates_per_s: float
    cents: float


def estimates(scene: Scene, rate_Hz: int) -> list[Estimate]:
    """First of the scene's own mesh as "now", then of draft, standard and, where the mesh takes it, fine."""
    own = dataclasses.replace(scene, modal=None)
    names = [name for name in ACCURACIES if name != "fine" or tiers.takes_fourth(scene.mesh)]
    tried = {"now": own} | {
        name: dataclasses.replace(own, mesh=dataclasses.replace(own.mesh, **_BY_NAME, accuracy=name))
        for name in names
    }
    return [of(name, at, rate_Hz) for name, at in tried.items()]


def of(name: str, scene: Scene, rate_Hz: int) -> Estimate:
    """Estimate the scene's mesh, under this name."""
    divisor = tiers.divisor_for(scene, rate_Hz)
    mesh_rate_Hz = rate_Hz / divisor
    scheme = tiers.scheme_at(scene, mesh_rate_Hz, tiers.order_of(scene, mesh_rate_Hz))
    across = tiers.junctions_across(scheme, mesh_rate_Hz, scene.drum.f01_Hz)
    # Effects take from the room for a wave.
    narrower = across / tiers.across_of(scene, mesh_rate_Hz)
    updates_per_s = narrower**2 * tiers.updates_per_s(scene, rate_Hz, divisor)
    return Estimate(name, mesh_rate_Hz, across, updates_per_s, rms_cents(scheme, across))
