"""As fast as a mesh can go, and faster; and junctions that nearly lie on the rim."""

import itertools
import math

import numpy as np
import pytest

from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.head_numbers import tension_rise
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.tiers import coefficients_of, takes_fourth
from drumstick.scenes.scene_text import SceneError, parse
from stability.catalogue import shows
from stability.dense_mesh import DenseMesh, Plane, grown
from stability.mesh_steps import drum_of

LIMIT = 8.0 / 3.0
_BURST = 1e12


def _rung(mesh: DenseMesh, laplacian: Plane, tau: float, steps: int) -> float:
    u = mesh.bump()
    before, sizes = u.copy(), list[float]()
    for _ in range(steps):
        u, before = 2.0 * u - before + tau * (laplacian @ u), u
        sizes.append(float(np.sum(u * u)))
        if not sizes[-1] < _BURST * sizes[0]:
            break
    return grown(sizes)


@shows("faster than the limit")
def test_a_mesh_beyond_its_limit_explodes_and_no_scene_gets_one() -> None:
    mesh = DenseMesh()
    assert _rung(mesh, mesh.laplacian, 1.02 * LIMIT, 2000) > _BURST
    assert _rung(mesh, mesh.laplacian, LIMIT, 2000) < 10.0
    for line in ('courant = "1.02"', "courant = 1.02", "rate_Hz = 1e6", "junctions_across = 1e4"):
        with pytest.raises(SceneError, match="mesh"):
            parse(f"[mesh]\n{line}\n", "beyond")


@shows("faster than the limit", "ours")
@pytest.mark.parametrize("topology", ["triangular", "rectilinear"])
@pytest.mark.parametrize("accuracy", ["draft", "standard", "fine"])
@pytest.mark.parametrize("courant", ["limit", "lossless"])
def test_whatever_a_scene_asks_for_leaves_every_mode_below_the_limit(
    topology: str, accuracy: str, courant: str
) -> None:
    """q of every mode that any mesh can have, with the most that glide, air and losses take."""
    mesh = {"topology": topology, "accuracy": accuracy, "courant": courant}
    if accuracy == "fine" and not takes_fourth(drum_of({}, mesh=mesh).mesh):
        return  # no scene may ask for it
    glides, airs = (0.0, 60.0, 1200.0), ((), (0.02, 0.05), (2.0, 2.0))
    dulls: tuple[tuple[float, ...], ...] = ((), (0.15, 2000.0), (0.001, 20000.0))
    for rate_Hz, cents, air, dull in itertools.product((4000.0, 16000.0, 192000.0), glides, airs, dulls):
        effects: dict[str, object] = {"tension": TensionTable(cents)} if cents else {}
        effects |= {"cavity": CavityTable(*air)} if air else {}
        effects |= {"internal_loss": InternalLossTable(*dull)} if dull else {}
        scene = drum_of(effects, t60_s=60.0, f01_Hz=150.0, mesh=mesh)
        numbers = coefficients_of(scene, 1.0 / rate_Hz)
        if 2.0 * numbers.spring >= 4.0:
            continue  # no mesh has room for it: so slow a one is made for low and wide drums only
        scheme, a = numbers.scheme, np.linspace(0.0, numbers.scheme.topology.max_eigenvalue, 301)
        q = scheme.tau * (1.0 + (tension_rise(scene.drum) or 0.0)) * a - scheme.order_4 * a * a
        # What the air adds counts in a mesh without losses, and its share of what losses leave.
        room = numbers.losses.most * (1.0 - numbers.spring / 2.0)
        assert np.max(q) <= room * (1.0 + 1e-12)
        assert 0.0 < scheme.tau <= 4.0


def _with_reflected_rim(mesh: DenseMesh) -> Plane:
    # Beyond the rim, u goes on as a straight line through 0 at the rim: -(1 - theta)/theta times the junction's own.
    count = len(mesh.x)
    open_ways = np.round((mesh.laplacian + np.eye(count)) / mesh.weights[:, None])
    cut_ways = 6.0 - open_ways.sum(axis=1)
    nearness = 1.0 / mesh.weights - open_ways.sum(axis=1)  # the sum of 1/theta over cut ways
    return open_ways / 6.0 - np.eye(count) - np.diag((nearness - cut_ways) / 6.0)


@shows("junction beside the rim")
def test_a_junction_beside_the_rim_is_as_stable_as_any_and_reflected_it_explodes() -> None:
    """Rim that cuts a way at 2 % of its length. Reflected, even the textbook's slower mesh, tau = 2, explodes."""
    mesh = DenseMesh()
    reflected = _with_reflected_rim(mesh)
    assert math.isclose(
        _rung(mesh, reflected, 0.5, 200), 1.0, rel_tol=1.0
    )  # far slower, it is a membrane too
    assert -np.linalg.eigvals(reflected).real.min() > 4.0
    assert _rung(mesh, reflected, 2.0, 500) > _BURST
    assert -np.linalg.eigvals(mesh.laplacian).real.min() < 1.5
    assert _rung(mesh, mesh.laplacian, LIMIT, 500) < 10.0
