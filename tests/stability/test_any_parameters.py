"""Every set that the table's ranges allow: no NaN, no endless loop, and no energy from nowhere."""

import math

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

import stick_cases
from drumstick import exact
from drumstick.declare import Quantity, quantities
from drumstick.effects.pulse import Pulse
from drumstick.law import law_of, thrown
from drumstick.scene import Scene
from drumstick.simulate import simulate
from drumstick.stick import Stick

MOST_EVENTS = 60
# How long to play: some time constants of the hand, not longer, or a light stick makes millions of contacts.
DURATION_S = 0.2


def _over(quantity: Quantity) -> st.SearchStrategy[float]:
    # Evenly over the decades, the limits and 0 included: uniform numbers would never try a small one.
    smallest = max(quantity.low, 1e-9)
    logarithmic = st.floats(math.log(smallest), math.log(quantity.high)).map(
        lambda x: min(max(math.exp(x), quantity.low), quantity.high)
    )
    limits = st.sampled_from([quantity.low, quantity.high])
    return logarithmic | logarithmic.map(lambda x: max(-x, quantity.low)) | limits


def _tables(kind: type) -> st.SearchStrategy[object]:
    fields: dict[str, st.SearchStrategy[object]] = {}
    for key, quantity in quantities(kind).items():
        fields[key] = st.sampled_from(quantity.choices) if quantity.choices else _over(quantity)
    return st.builds(kind, **fields)


STICKS, PULSES = _tables(Stick), _tables(Pulse)
SPEEDS = st.floats(-10.0, 10.0)


def _energy(stick: Stick, z: float, v: float, in_head: bool) -> float:
    # Divided by m. In the head its spring counts, also while the stick is loose: it is still compressed then.
    spring = stick.k_coll_N_per_m * z * z if in_head else 0.0
    hand = stick.k_hand_N_per_m * (z - stick.z_ss_m) ** 2
    return 0.5 * v * v + 0.5 * (spring + hand) / stick.m_kg


@settings(max_examples=300)
@given(STICKS, st.none() | PULSES, SPEEDS)
@example(Stick(1e-4, 1e6, 1e3, 1e4, 1e3, -1.0, "paper"), Pulse(10.0, 1e-6, "exit", 1), 10.0)
@example(Stick(1e-4, 1e6, 0.0, 1e4, 1e3, 1.0, "unilateral"), Pulse(10.0, 1.0, "entry", -1), -10.0)
@example(Stick(1.0, 1.0, 0.0, 0.0, 0.0, 0.0, "unilateral"), None, 0.0)
def test_nothing_becomes_nan_and_every_event_moves_on(stick: Stick, pulse: Pulse | None, v0: float) -> None:
    scene = stick_cases.scene(stick, pulse)
    law, motion, t = law_of(scene), thrown(scene, v0), 0.0
    for _ in range(MOST_EVENTS):
        event, moved = exact.advance(law[0], motion[0], DURATION_S - t)
        t += moved
        assert 0.0 <= moved <= DURATION_S
        for name in motion.dtype.names or ():
            if name != "pulse":
                assert math.isfinite(motion[name][0]), name
        if pulse is not None:
            assert math.isfinite(motion["pulse"]["push"][0])
        assert motion["place"][0] != exact.ABOVE or motion["z"][0] >= -1e-12
        if event == exact.RELEASE:
            assert motion["v_in"][0] <= 0.0
            assert motion["v_out"][0] >= -1e-12
            assert motion["peak_N"][0] >= 0.0
            assert motion["z_min"][0] <= 0.0
        if event == exact.HORIZON or motion["fate"][0] != exact.MOVING or t >= DURATION_S:
            return


@settings(max_examples=300)
@given(STICKS, SPEEDS)
def test_without_a_pulse_energy_never_grows(stick: Stick, v0: float) -> None:
    if stick.release == "unilateral" and stick.r_in_N_s_per_m < stick.r_out_N_s_per_m:
        return  # then the head's own damper is negative: it does give energy
    scene = stick_cases.scene(stick)
    law, motion, t = law_of(scene), thrown(scene, v0), 0.0
    before = start = _energy(stick, 0.0, v0, in_head=False)
    for _ in range(MOST_EVENTS):
        event, moved = exact.advance(law[0], motion[0], DURATION_S - t)
        t += moved
        z, v = float(motion["z"][0]), float(motion["v"][0])
        now = _energy(stick, z, v, in_head=z < 0.0)
        assert now <= before * (1.0 + 1e-9) + start * 1e-12
        before = now
        if event == exact.HORIZON or motion["fate"][0] != exact.MOVING or t >= DURATION_S:
            return


@settings(max_examples=100)
@given(STICKS, PULSES, SPEEDS)
def test_a_run_ends_and_its_rows_are_in_order(stick: Stick, pulse: Pulse, v0: float) -> None:
    duration_s = 200.0 * math.sqrt(stick.m_kg / stick.k_coll_N_per_m)
    run = simulate(Scene("any", stick=stick, effects={"pulse": pulse}), duration_s, v0)
    assert np.all(np.isfinite(run.contacts))
    assert np.all(run.contacts[:, 0] <= run.contacts[:, 2])
    assert np.all(run.contacts[1:, 0] >= run.contacts[:-1, 2])
    assert run.t_end_s <= duration_s * (1.0 + 1e-12)
