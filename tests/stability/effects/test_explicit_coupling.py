"""A glide, air, a muffle and wires, each taken a step late or at its beginning, and as the drum takes them."""

import numpy as np
import pytest

from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.snare import SnareTable, solve_overlap
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.membrane.scheme import even_losses
from drumstick.drum.tiers import coefficients_of
from membranes import energy
from realtime.records import is_there
from stability.catalogue import shows
from stability.dense_mesh import DenseMesh, Plane, grown
from stability.mesh_steps import RATE, drum_of, engine_of, strike, take

_BURST = 1e12  # where a naive run is stopped


def _late_tension(depth: float, steps: int) -> float:
    # Of the pitch; q follows the stretch of a step ago. The mesh has room for the most that q can be.
    mesh = DenseMesh()
    tau = 8.0 / 3.0 / (1.0 + 2.2 * depth)
    u = mesh.bump()
    before, half, energies = u.copy(), 0.5 * mesh.stretch(u, u), list[float]()
    for _ in range(steps):
        stretch = mesh.stretch(u, before)
        q = 2.0 * depth * tau * stretch / (abs(stretch) + half)
        u, before = 2.0 * u - before + (tau + q) * (mesh.laplacian @ u), u
        energies.append(mesh.energy(u, before, tau))
        if not energies[-1] < _BURST * energies[0]:
            break
    return grown(energies)


@shows("pitch glide")
def test_a_tension_a_step_late_pumps_the_head_and_ours_at_an_octave_does_not() -> None:
    assert _late_tension(0.002, 4000) > 1.2
    assert _late_tension(0.02, 4000) > 1e9
    engine = engine_of(drum_of({"tension": TensionTable(1200.0)}))  # fifty times 0.02
    assert is_there(engine.effects.tension)
    strike(engine, 40.0)
    take(engine, 8)
    first, pulls = energy(engine), list[float]()
    for _ in range(60):
        take(engine, 333)
        pulls.append(float(engine.effects.tension.state["pull"][0]) / float(engine.control["tau"][0]))
        assert energy(engine) == pytest.approx(first, rel=1e-4)
    assert np.ptp(pulls) > 0.2  # it was played with


def _late_air(spring: float, steps: int) -> float:
    # The air's push follows the heads' places of a step ago; both heads leave it the room that ours do.
    first, second = DenseMesh(), DenseMesh(10.7)
    tau = (4.0 - 2.0 * spring) / 1.5
    areas = first.lattice.area, second.lattice.area
    u, v = first.bump(), np.zeros(len(second.x))
    u_before, v_before, apart, energies = u.copy(), v.copy(), float(u.sum()) / areas[0], list[float]()

    def moved(mesh: DenseMesh, now: Plane, before: Plane, push: float) -> Plane:
        return 2.0 * now - before + tau * (mesh.laplacian @ now) + 6.0 * push * mesh.weights

    for _ in range(steps):
        coming = moved(first, u, u_before, -spring * apart), moved(second, v, v_before, spring * apart)
        apart = float(u.sum()) / areas[0] - float(v.sum()) / areas[1]
        u_before, v_before = u, v
        u, v = coming
        energies.append(
            first.energy(u, u_before, tau) + areas[0] / areas[1] * second.energy(v, v_before, tau)
        )
        if not energies[-1] < _BURST * energies[0]:
            break
    return grown(energies)


@shows("air between the heads")
def test_air_a_step_late_drives_both_heads_and_ours_at_its_stiffest_does_not() -> None:
    """Two centimetres of air between heads of 50 g/m^2, the ends of their ranges."""
    stiffest = CavityTable(depth_m=0.02, head_kg_per_m2=0.05, f01_Hz=700.0, t60_s=60.0)
    scene = drum_of({"cavity": stiffest}, mesh={"rate_Hz": 24_000.0})  # a finer mesh would be less stiff
    engine = engine_of(scene)
    spring = coefficients_of(scene, float(engine.control["divisor"][0]) / RATE).spring
    assert spring > 0.2
    assert _late_air(spring, 1000) > _BURST
    strike(engine, 4.0)
    take(engine, 8)
    held = [energy(engine)]
    for _ in range(200):
        take(engine, 10)
        held.append(energy(engine))
    assert np.max(np.diff(held)) <= 2e-6 * held[0]
    assert held[-1] > 0.9 * held[0]  # the second head's own losses


@shows("heavy muffle")
def test_a_damper_by_the_last_speed_explodes_under_a_heavy_muffle_and_ours_only_takes() -> None:
    t60_s, mesh = 0.001, DenseMesh()
    s = even_losses(t60_s, 1.0 / RATE).s
    under = np.hypot(mesh.x - 0.5, mesh.y - 0.2) < 0.3
    u = mesh.bump()
    before, energies = u.copy(), list[float]()
    while len(energies) < 2000 and not (energies and energies[-1] > _BURST):
        u, before = 2.0 * u - before + 8.0 / 3.0 * (mesh.laplacian @ u) - 2.0 * s * under * (u - before), u
        energies.append(float(np.sum(u * u)))
    assert energies[-1] > _BURST
    engine = engine_of(drum_of({"muffle": MuffleTable(((0.5, 0.2, 0.3),), t60_s)}))
    strike(engine, 4.0)
    take(engine, 8)
    held = [energy(engine)]
    for _ in range(200):
        take(engine, 1)
        held.append(energy(engine))
    assert np.max(np.diff(held)) <= 2e-6 * held[0]
    assert held[-1] < 0.7 * held[0]


def _wire_on_head(stiffness: float, explicit: bool, steps: int = 5000) -> float:
    # A point of half a junction's mass on a spring, under a junction on another, in touch by and by; the largest energy
    # of all steps, in units of the first.
    heavy, light, hold, spring = 1.0, 0.5, 0.03, 0.002
    u = u_before = 1.0
    x = x_before = eta_before = 0.0
    compliance, energies = 1.0 / heavy + 1.0 / light, list[float]()
    for _ in range(steps):
        eta = u - x
        free_u, free_x = 2.0 * u - u_before - hold * u, 2.0 * x - x_before - spring * x
        force = stiffness * max(eta, 0.0)
        if not explicit:
            free = free_u - free_x
            force = (free - solve_overlap(eta_before, free, 0.5 * stiffness * compliance)) / compliance
        u_before, u, x_before, x, eta_before = u, free_u - force / heavy, x, free_x + force / light, eta
        kinetic = heavy * (u - u_before) ** 2 + light * (x - x_before) ** 2
        springs = heavy * hold * u * u_before + light * spring * x * x_before
        touch = 0.5 * stiffness * (max(u - x, 0.0) ** 2 + max(eta, 0.0) ** 2)
        energies.append(0.5 * (kinetic + springs + touch))
        if not energies[-1] < _BURST * energies[0]:
            break
    return grown(energies)


@shows("wires on the head")
@pytest.mark.parametrize("stiffer", [1.0, 10.0, 1000.0])
def test_wires_pushed_by_where_they_are_gain_energy_and_by_the_gradient_they_do_not(stiffer: float) -> None:
    """In units of the stiffness with which the two in touch turn by a radian a step, which is the drum's."""
    stiffness = stiffer / 3.0
    assert _wire_on_head(stiffness, explicit=True) > 1.1
    assert _wire_on_head(stiffness, explicit=False) == pytest.approx(1.0, abs=1e-9)


@shows("wires on the head", "ours")
def test_wires_at_the_ends_of_their_ranges() -> None:
    """Forty heavy wires that hardly lose, under a blow a thousand times as hard as theirs that lies on."""
    cavity = CavityTable(depth_m=0.02, head_kg_per_m2=0.05, f01_Hz=700.0, t60_s=60.0)
    engine = engine_of(drum_of({"cavity": cavity, "snare": SnareTable(42, 50.0, 200.0, 10.0, 10.0)}))
    strike(engine, 40.0)
    take(engine, 8)
    held = [energy(engine)]
    for _ in range(200):
        take(engine, 10)
        held.append(energy(engine))
    assert np.max(np.diff(held)) <= 2e-6 * held[0]
