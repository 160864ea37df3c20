import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from drumstick.drum.build import new_engine
from drumstick.drum.engine import Engine
from drumstick.drum.excitation.analytic import apply_forces, begin, damp, mean_force
from drumstick.drum.memory.pulses import CONTACT, POOL, PULSE
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.scenes.scene_text import parse, shipped_text


def engine_of(inject: str = "nearest") -> Engine:
    text = shipped_text("bare-drum").replace("[drum]", f'[drum]\ninject = "{inject}"')
    return new_engine(parse(text, "drum"), 48000, StrikeRing())


@given(st.floats(0.0, 300.0), st.floats(-20.0, 0.0))
def test_the_impulse_is_exact_wherever_the_onset_falls(duration: float, age: float) -> None:
    pulses = np.zeros(1, PULSE)
    begin(pulses, 0, 0.0, 0.0, age, duration, 7.0)
    forces: list[float] = []
    while pulses[0]["age"] < pulses[0]["duration"]:
        forces.append(mean_force(pulses[0]))
        pulses[0]["age"] += 1.0
    assert sum(forces) == pytest.approx(7.0 * 2.0 / math.pi * max(duration, 1e-3), rel=1e-9)
    assert min(forces) >= -1e-12
    assert max(forces) <= 7.0 + 1e-9


def damped(
    duration: float, age: float, impulse: float, decay: float, own_decay: float, pulls: bool
) -> np.ndarray:
    """Mean forces of all steps of a damped pulse; decays a step."""
    pulses, contact = np.zeros(1, PULSE), np.zeros(1, CONTACT)
    begin(pulses, 0, 0.0, 0.0, age, duration, 7.0)
    contact[0] = (decay, own_decay, pulls)
    damp(pulses[0], contact[0], impulse)
    forces: list[float] = []
    while pulses[0]["age"] < pulses[0]["duration"]:
        forces.append(mean_force(pulses[0]))
        pulses[0]["age"] += 1.0
    return np.array(forces)


@given(
    st.floats(0.0, 300.0), st.floats(-20.0, 0.0), st.floats(1e-6, 1e3), st.floats(0.0, 10.0), st.floats(0.0, 1.0),
    st.booleans(),
)  # fmt: skip
def test_a_told_impulse_is_exact_for_any_contact(
    duration: float, age: float, impulse: float, decay: float, share: float, pulls: bool
) -> None:
    forces = damped(duration, age, impulse, decay, share * decay, pulls)
    assert np.sum(forces) == pytest.approx(impulse, rel=1e-9)
    if not pulls:
        assert np.min(forces) >= -1e-9 * impulse


@pytest.mark.parametrize("release", ["paper", "unilateral"])
@pytest.mark.parametrize("r_out", [0.0, 0.4])
def test_a_lone_blow_is_that_of_the_equation_of_motion(release: str, r_out: float) -> None:
    """m z'' = -K z - R_in z', by another program; the head's part of the damper is R_in - R_out."""
    m, k, r_in, step_s = 0.015, 5000.0, 1.3, 1.0 / 16_000.0

    def motion(_: float, y: np.ndarray) -> tuple[float, float, float]:
        return y[1], (-k * y[0] - r_in * y[1]) / m, -k * y[0] - (r_in - r_out) * y[1]

    def leaves(_: float, y: np.ndarray) -> float:
        return y[0] if release == "paper" else k * y[0] + (r_in - r_out) * y[1]

    leaves.terminal, leaves.direction = True, 1.0  # ty: ignore[missing-attribute]  scipy looks for them
    options: dict[str, Any] = {"rtol": 1e-12, "atol": 1e-15, "dense_output": True}
    solved = solve_ivp(motion, (0.0, 0.1), (-1e-300, -1.0, 0.0), events=leaves, **options)
    lasts_s, impulse = float(solved.t[-1]), float(solved.y[2, -1])
    ends_s = np.minimum(np.arange(math.ceil(lasts_s / step_s) + 1) * step_s, lasts_s)
    expected = np.diff(solved.sol(ends_s)[2]) / step_s
    per_step = step_s / (2.0 * m)
    found = damped(
        lasts_s / step_s,
        0.0,
        impulse / step_s,
        r_in * per_step,
        (r_in - r_out) * per_step,
        release == "paper",
    )
    np.testing.assert_allclose(found, expected, atol=1e-6 * float(np.max(expected)))


def test_the_onset_may_fall_between_steps() -> None:
    pulses = np.zeros(2, PULSE)
    begin(pulses, 0, 0.0, 0.0, 0.0, 10.0, 1.0)
    begin(pulses, 1, 0.0, 0.0, -0.5, 10.0, 1.0)
    first, later = mean_force(pulses[0]), mean_force(pulses[1])
    # The first half step of sin(pi t / 10): its integral is 10/pi (1 - cos(pi/20)).
    assert later == pytest.approx(10.0 / math.pi * (1.0 - math.cos(math.pi / 20.0)))
    assert later < first


def test_when_the_pool_is_full_the_oldest_pulse_ends() -> None:
    engine = engine_of()
    begun = 0
    for number in range(POOL + 1):
        begun = begin(engine.pulses, begun, 0.01 * number, 0.0, 0.0, 100.0, 1.0)
    assert apply_forces(engine) == POOL
    assert 0.0 not in engine.pulses["x"]
    assert (engine.pulses["age"] == 1.0).all()


@pytest.mark.parametrize("inject", ["nearest", "linear"])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.41, -0.23), (0.9, 0.3), (5.0, 5.0)])
def test_a_force_is_whole_wherever_it_falls(inject: str, place: tuple[float, float]) -> None:
    """Far from the rim; near it a junction has less mass, and beyond it the place is drawn in."""
    engine = engine_of(inject)
    begin(engine.pulses, 0, *place, 0.0, 1e3, 1.0)
    apply_forces(engine)
    forces = engine.forces[: int(engine.control["forces"][0])]
    assert len(forces) == (1 if inject == "nearest" else 3)
    weights = engine.head.weights[forces["junction"]]
    shares = forces["step"] / (weights * engine.control["force_gain"][0] * mean_force_of(1e3))
    assert np.sum(shares) == pytest.approx(1.0)


def mean_force_of(duration: float) -> float:
    pulses = np.zeros(1, PULSE)
    begin(pulses, 0, 0.0, 0.0, 0.0, duration, 1.0)
    return mean_force(pulses[0])


def test_linear_injection_does_not_step_where_nearest_does() -> None:
    """A strike that wanders by a hundredth of a spacing at a time: its force never jumps from junction to junction."""
    jumps: dict[str, float] = {}
    for inject in ("nearest", "linear"):
        engine, size = engine_of(inject), 0.0
        spread = np.zeros(engine.head.weights.size)
        for x in np.arange(0.2, 0.3, 0.01 * float(engine.head.grid["spacing"][0])):
            engine.pulses["age"] = 1e9
            begin(engine.pulses, 0, float(x), 0.1, 0.0, 1e3, 1.0)
            apply_forces(engine)
            before, spread = spread, np.zeros_like(spread)
            forces = engine.forces[: int(engine.control["forces"][0])]
            np.add.at(spread, forces["junction"], forces["step"])
            if before.any():
                size = max(size, float(np.abs(spread - before).sum() / spread.sum()))
        jumps[inject] = size
    assert jumps["nearest"] == pytest.approx(2.0)
    assert jumps["linear"] < 0.05
