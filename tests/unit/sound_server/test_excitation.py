import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.scene import parse, shipped_text
from sound_server.build import new_engine
from sound_server.engine import Engine
from sound_server.events import StrikeRing
from sound_server.excitation import POOL, PULSE, begin, mean_force, press


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
    assert press(engine) == POOL
    assert 0.0 not in engine.pulses["x"]
    assert (engine.pulses["age"] == 1.0).all()


@pytest.mark.parametrize("inject", ["nearest", "linear"])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.41, -0.23), (0.9, 0.3), (5.0, 5.0)])
def test_a_force_is_whole_wherever_it_falls(inject: str, place: tuple[float, float]) -> None:
    """Far from the rim; near it a junction has less mass, and beyond it the place is drawn in."""
    engine = engine_of(inject)
    begin(engine.pulses, 0, *place, 0.0, 1e3, 1.0)
    press(engine)
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
            press(engine)
            before, spread = spread, np.zeros_like(spread)
            forces = engine.forces[: int(engine.control["forces"][0])]
            np.add.at(spread, forces["junction"], forces["step"])
            if before.any():
                size = max(size, float(np.abs(spread - before).sum() / spread.sum()))
        jumps[inject] = size
    assert jumps["nearest"] == pytest.approx(2.0)
    assert jumps["linear"] < 0.05
