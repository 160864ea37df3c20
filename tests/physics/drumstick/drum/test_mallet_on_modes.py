"""A mallet on a bank of modes against the same equations solved in continuous time, and against the mesh."""

import dataclasses
import math
from typing import Any, cast

import numpy as np
import pytest
from scipy import integrate

from drumstick.drum.build import new_engine
from drumstick.drum.engine import Engine
from drumstick.drum.mallets.mallet import GONE
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.modes import modes_below, shapes_at
from drumstick.parameters.drum import Modal
from drumstick.parameters.mallet import MATERIALS
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse
from mallets import start_mallet, with_mallet
from stability.mesh_steps import RATE, take

SPEED, AT = 1.0, (0.3, 0.2)


def _scene(material: str, f01_Hz: float, **numbers: float) -> Scene:
    scene = parse(f"[drum]\nf01_Hz = {f01_Hz}\nt60_s = 0.5\n", "drum")
    return with_mallet(scene, material=material, **{**MATERIALS[material], **numbers})


def _of_modes(scene: Scene) -> Scene:
    return dataclasses.replace(scene, modal=Modal(10_000.0))


def _pushes(scene: Scene, rate: int = RATE) -> tuple[np.ndarray, float]:
    """Force of one blow in each step, N, from the strike's instant on; length of a step, s."""
    engine = new_engine(scene, rate, StrikeRing())
    start_mallet(engine, SPEED, *AT)
    assert engine.mallets is not None
    found: list[float] = []
    step_s = float(engine.mallets.state["step_s"][0])
    for _ in range(round(0.02 / step_s)):
        take(engine, 1)
        found.append(float(engine.mallets.pool["force"][0]))
    return np.array(found), step_s


def _in_continuous_time(scene: Scene, t_s: np.ndarray) -> np.ndarray:
    """F at these times, from q'' + 2 sigma q' + (w^2 + sigma^2) q = c^2 F g/norm of each mode, and m x'' = -F."""
    assert scene.mallet is not None
    mallet, drum = scene.mallet, scene.drum
    modes = modes_below(10_000.0 / drum.f01_Hz * J01)
    a = modes.zeros * mallet.tip_radius_m / drum.radius_m
    # The mean of a plane wave under 1 - (r/R)^2, by its series in a^2/4.
    tip: Any = sum(
        2.0 * (-(a**2) / 4.0) ** k / (math.factorial(k) * math.factorial(k + 2)) for k in range(40)
    )
    shares = np.concatenate(shapes_at(modes, *AT)) * np.tile(tip, 2)
    w = np.tile(2.0 * math.pi * drum.f01_Hz * modes.zeros / J01, 2)
    sigma = 3.0 * math.log(10.0) / drum.t60_s
    c = 2.0 * math.pi * drum.f01_Hz / J01
    engine = new_engine(scene, RATE, StrikeRing())
    assert engine.mallets is not None
    unit_m = float(engine.mallets.state["unit_m"][0])
    driven = unit_m * c**2 * shares / np.tile(modes.norms, 2)
    size = len(w)

    def push(state: Any) -> float:
        depth = state[-2] - shares @ state[:size]
        if depth <= 0.0:
            return 0.0
        speed = state[-1] - shares @ state[size:-2]
        return max(
            0.0, mallet.stiffness_N_per_m_p * depth**mallet.exponent * (1.0 + mallet.loss_s_per_m * speed)
        )

    def moved(_: float, state: Any) -> Any:
        force = push(state)
        q, d = state[:size], state[size:-2]
        return np.concatenate(
            [
                d,
                driven * force - 2.0 * sigma * d - (w**2 + sigma**2) * q,
                [state[-1], -force / mallet.mass_kg],
            ]
        )

    first = np.zeros(2 * size + 2)
    first[-1] = SPEED
    solve: Any = cast(Any, integrate).solve_ivp
    found = solve(moved, (0.0, float(t_s[-1])), first, "DOP853", t_s, rtol=1e-9, atol=1e-13, max_step=1e-5)
    return np.array([push(state) for state in found.y.T])


@pytest.mark.daily("felt*")
@pytest.mark.parametrize(("material", "close", "finely"), [("wood", 5e-3, 5e-3), ("felt", 1e-3, 2e-4)])
def test_it_pushes_as_the_equations_say(
    material: str, close: float, finely: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All modes below 10 kHz of a high drum. At the rate that plays: the impulse, and the contact to two steps. At
    eight times that rate: every push, to this much of the largest."""
    scene = _of_modes(_scene(material, 1000.0))
    found, step_s = _pushes(scene)
    exact = _in_continuous_time(scene, step_s * np.arange(len(found)))
    assert np.sum(found) == pytest.approx(np.sum(exact), rel=close)
    assert np.count_nonzero(found) == pytest.approx(np.count_nonzero(exact), abs=2)

    def every_sample(scene: Scene, rate_Hz: float) -> int:
        return 1

    monkeypatch.setattr("drumstick.drum.modal.building.divisor_below", every_sample)
    found, step_s = _pushes(scene, rate=8 * RATE)
    exact = _in_continuous_time(scene, step_s * np.arange(len(found)))
    assert exact.max() > 10.0
    np.testing.assert_allclose(found, exact, atol=finely * exact.max())


@pytest.mark.long
@pytest.mark.parametrize("material", ["wood", "felt"])
def test_modes_and_mesh_throw_it_back_alike(material: str) -> None:
    """On the drum of `roll`, whose mesh ends where the modes do: impulse and contact time of one blow."""
    scene = _scene(material, 150.0)
    (on_mesh, mesh_s), (on_modes, modes_s) = _pushes(scene), _pushes(_of_modes(scene))
    impulse = np.sum(on_mesh) * mesh_s
    assert np.sum(on_modes) * modes_s == pytest.approx(impulse, rel=0.02)
    assert np.count_nonzero(on_modes) * modes_s == pytest.approx(np.count_nonzero(on_mesh) * mesh_s, rel=0.06)


def _engine(top_Hz: float) -> Engine:
    scene = dataclasses.replace(_scene("wood", 150.0), modal=Modal(top_Hz))
    return new_engine(scene, RATE, StrikeRing())


def test_what_two_mallets_push_is_felt_by_both_in_the_same_step() -> None:
    """A newton at one moves the head under the other as much as the other way round, and the depths are the heights
    that there really are, to what float32 rounds."""
    engine = _engine(3000.0)
    assert engine.mallets is not None
    assert engine.modal is not None
    start_mallet(engine, 1.0, 0.3, 0.0)
    start_mallet(engine, 1.5, 0.1, 0.1)
    pressed = 0
    for _ in range(30):
        take(engine, 1)
        assert engine.modal.masses is not None
        shares = engine.modal.masses.astype(float) * engine.modal.strike_weights[:2]
        heights = float(engine.mallets.state["unit_m"][0]) * shares @ engine.modal.q.astype(float)
        deep = engine.mallets.pool["now"][:2] - heights
        plays = engine.mallets.pool["stage"][:2] != GONE
        np.testing.assert_allclose(engine.mallets.tips["depth"][:2][plays], deep[plays], atol=1e-9)
        pressed += bool((engine.mallets.pool["force"][:2] > 0.0).all())
    assert pressed > 3
    mutual_compliance = (
        engine.mallets.shares.mutual_compliance if engine.mallets.shares is not None else np.zeros((2, 2))
    )
    assert mutual_compliance[0, 1] == pytest.approx(mutual_compliance[1, 0], rel=1e-12)
    assert mutual_compliance[0, 1] != 0.0


def test_one_that_comes_down_in_the_same_place_takes_the_first_away() -> None:
    engine = _engine(10_000.0)
    assert engine.mallets is not None
    for x in (0.5, -0.5):
        start_mallet(engine, 1.0, x, 0.0)
    take(engine, 5)
    assert engine.mallets.state["lifted"][0] == 0
    start_mallet(engine, 1.0, 0.5, 0.0)
    take(engine, 5)
    assert engine.mallets.state["lifted"][0] == 1
    assert (engine.mallets.pool["stage"][:2] != GONE).tolist() == [False, True]


def test_a_mallet_on_the_hoop_meets_what_does_not_move() -> None:
    engine = _engine(3000.0)
    start_mallet(engine, 1.0, 1.0, 0.0)
    assert take(engine, 20) < 1e-6
    assert engine.mallets is not None
    assert engine.mallets.pool["now"][0] < engine.mallets.pool["before"][0]


def test_without_mallets_a_bank_has_nothing_of_them() -> None:
    engine = new_engine(Scene("drum", modal=Modal(3000.0)), RATE, StrikeRing())
    assert engine.mallets is None
    assert engine.modal is not None
    assert engine.modal.masses is None
