"""Cycles and their multipliers, what a throw settles into, and the predictions beside them."""

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import any_scene
import stick_cases
from drumstick.analysis.cycles.fixed_points import fixed_points
from drumstick.analysis.cycles.return_map import return_map
from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.findings import Findings, analyse
from drumstick.analysis.speeds import roll_speeds
from drumstick.parameters.rig import Hand
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.cor_pulse import CorPulse
from drumstick.stick.effects.noise import Noise
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of
from drumstick.stick.simulate import COLUMNS, simulate

CYCLES = stick_cases.rows("limit_cycles.csv")
BY_CASE = {row["case"]: row for row in CYCLES}
A = stick_cases.STICK_A
V_E = COLUMNS.index("v_e_m_per_s")


def _primary(found: Findings):
    assert found.primary is not None
    return found.cycles[found.primary]


@pytest.mark.parametrize("case", BY_CASE)
def test_reference_case(case: str) -> None:
    """Every column that describes the settled roll, to 1e-9; its multiplier to 1e-6."""
    row = BY_CASE[case]
    found = analyse(stick_cases.cycle_scene(row))
    roll = _primary(found)
    ours = {
        "beta_eq3": found.beta_eq3,
        "beta_meas_at_vin": found.beta_measured,
        "alpha_meas": found.alpha,
        "v_lc_eq7(beta_eq3,alpha_meas)": found.v_lc_eq7_m_per_s,
        "v_E": roll.v_e_m_per_s,
        "v_in": roll.v_in_m_per_s,
        "roll_rate_hz": roll.rate_Hz,
        "z_apex": roll.apex_m,
        "t_contact": roll.contact_s,
    }
    for name, value in ours.items():
        expected = pytest.approx(float(row[name]), rel=1e-9) if row[name] else None
        assert value == expected, name
    assert roll.stable
    assert roll.period == int(row["period_k"])
    if row["floquet_multiplier"]:
        assert roll.multiplier == pytest.approx(float(row["floquet_multiplier"]), abs=1e-6)
    assert found.throw_ends == "cycle"
    assert not found.overdamped


@pytest.mark.daily("[AC]*")
@pytest.mark.parametrize("case", [c for c in BY_CASE if BY_CASE[c]["kappa=(v_E-beta|v_in|)/dv"]])
def test_kappa_of_the_cycle_itself(case: str) -> None:
    """v_E = beta |v_in| + kappa dv, with the reference's own kappa of the cycle."""
    row = BY_CASE[case]
    found = analyse(stick_cases.cycle_scene(row))
    roll = _primary(found)
    assert found.beta_measured is not None
    kappa = (roll.v_e_m_per_s + found.beta_measured * roll.v_in_m_per_s) / float(row["dv"])
    assert kappa == pytest.approx(float(row["kappa=(v_E-beta|v_in|)/dv"]), rel=1e-9)


def test_equation_7_is_a_quick_pulse_into_the_drum() -> None:
    """The sign question: kappa is beta there, -1 for the text's pulse up, and 1 at exit."""
    into, up, leaving = (
        analyse(stick_cases.scene(A, Pulse(1.0, 1e-6, trigger, sign)))  # pyright: ignore[reportArgumentType]
        for trigger, sign in (("entry", -1), ("entry", 1), ("exit", 1))
    )
    assert into.kappa == pytest.approx(into.beta_eq3, rel=1e-3)
    assert into.v_lc_eq7_m_per_s is not None
    assert up.kappa == pytest.approx(-into.kappa, rel=1e-12)
    assert leaving.kappa == 1.0
    # Thrown back before it compresses the head: dv/(1 + alpha), and the exact motion agrees.
    assert up.v_lc_kappa_m_per_s == pytest.approx(1.0 / (1.0 + up.alpha), rel=1e-12)
    assert _primary(up).v_e_m_per_s == pytest.approx(up.v_lc_kappa_m_per_s, rel=1e-3)


def test_every_cycle_is_a_fixed_point_of_the_return_map() -> None:
    """Also the unstable one; the slope there is the multiplier, while the pulse is over before the next contact."""
    altered = Scene("cor", stick=A, effects={"cor_pulse": CorPulse(0.35, 0.0005, "exit", 1)})
    cycles = analyse(altered).cycles
    assert [cycle.stable for cycle in cycles] == [False, True]
    speeds = np.array([cycle.v_e_m_per_s for cycle in cycles])
    np.testing.assert_allclose(return_map(altered, speeds), speeds, rtol=1e-12)
    plain = stick_cases.scene(A, Pulse(0.2, 0.0005, "exit", 1))
    roll = _primary(analyse(plain))
    v = roll.v_e_m_per_s
    before, here, after = return_map(plain, np.array([v * (1.0 - 1e-5), v, v * (1.0 + 1e-5)]))
    assert here == pytest.approx(v, rel=1e-12)
    assert (after - before) / (2e-5 * v) == pytest.approx(roll.multiplier, rel=1e-6)


def test_the_return_map_has_no_value_below_the_pulse() -> None:
    """At exit v_E holds all of dv; a slow contact is captured."""
    scene = stick_cases.scene(A, Pulse(0.2, 0.002, "exit", 1))
    after = return_map(scene, np.array([0.1, 0.199, 0.3, 0.63]))
    assert np.isnan(after[:2]).all()
    assert np.isfinite(after[2:]).all()


def test_an_alteration_that_equation_8_calls_unstable_has_a_stable_upper_cycle() -> None:
    """alpha (beta + gamma) is above 1 at low speed and below it at high speed, because alpha falls."""
    scene = Scene("cor", stick=A, effects={"cor_pulse": CorPulse(0.35, 0.0005, "exit", 1)})
    found = analyse(scene)
    unstable, stable = found.cycles
    assert (unstable.stable, stable.stable) == (False, True)
    assert unstable.multiplier > 1.0
    assert found.kappa is None
    assert found.v_lc_eq7_m_per_s is None
    assert found.alpha is not None
    assert found.beta_measured is not None
    assert found.alpha * (found.beta_measured + 0.35) == pytest.approx(1.0, abs=1e-2)
    for v0, end in ((0.97, "captured"), (1.03, "time")):
        assert simulate(scene, 20.0, unstable.v_e_m_per_s * v0).end == end
    v_e = simulate(scene, 60.0, unstable.v_e_m_per_s * 1.03).contacts[-1, V_E]
    assert v_e == pytest.approx(stable.v_e_m_per_s, rel=1e-9)


def test_both_pulses_at_once_and_long_ones() -> None:
    """A state of three numbers: the settled motion of a plain simulation is the cycle that the search finds."""
    effects = {"pulse": Pulse(0.8, 0.08, "exit", 1), "cor_pulse": CorPulse(0.1, 0.05, "turn", 1)}
    scene = Scene("both", stick=A, effects=effects)
    roll = _primary(analyse(scene))
    contacts = simulate(scene, 400.0).contacts
    assert roll.v_e_m_per_s == pytest.approx(contacts[-1, V_E], rel=1e-9)
    # The multiplier is the rate at which the simulation itself settles.
    v_e = contacts[:, V_E] - roll.v_e_m_per_s
    settling = [i for i in range(len(v_e)) if 1e-9 < abs(v_e[i]) < 1e-6]
    shrinking = (abs(v_e[settling[-1]]) / abs(v_e[settling[0]])) ** (1.0 / (settling[-1] - settling[0]))
    assert shrinking == pytest.approx(abs(roll.multiplier), rel=0.05)


def test_a_pulse_that_waits_fires_only_now_and_then() -> None:
    """overlap = ignore: when it fired last is part of the motion, so the cycle spans several contacts."""
    scene = stick_cases.scene(A, Pulse(0.9, 0.02, "exit", 1, "ignore"))
    found = analyse(scene)
    v_e = simulate(scene, 100.0).contacts[-64:, V_E]
    if found.throw_ends == "cycle":
        roll = _primary(found)
        assert roll.period > 1
        assert roll.v_e_m_per_s == pytest.approx(v_e.max(), rel=1e-9)
        np.testing.assert_allclose(v_e[roll.period :], v_e[: -roll.period], rtol=1e-9)
    for cycle in found.cycles:
        assert cycle.period > 1 or 1.0 / cycle.rate_Hz > 5.0 * 0.02


def test_a_throw_that_ends_otherwise() -> None:
    dead = analyse(stick_cases.scene(A))
    assert (dead.throw_ends, dead.cycles, dead.primary) == ("captured", (), None)
    # Without a cycle alpha and beta are those at the throw's speed.
    assert dead.alpha is not None
    assert dead.beta_measured is not None
    assert dead.v_lc_eq7_m_per_s is None
    assert dead.v_lc_kappa_m_per_s is None
    gone = analyse(stick_cases.scene(Stick(0.015, 5000.0, 1.3, 20.0, 0.1, 0.05, "paper"), Pulse(0.5)))
    assert gone.throw_ends == "left"
    assert gone.alpha is None
    overdamped = analyse(stick_cases.scene(Stick(0.015, 5000.0, 40.0, 20.0, 0.1, -0.02, "paper"), Pulse()))
    assert overdamped.overdamped
    assert (overdamped.beta_eq3, overdamped.beta_measured, overdamped.kappa) == (None, None, None)


def test_the_throw_decides_which_stable_cycle_is_primary() -> None:
    """Rest and a roll are both stable here: a slow throw ends in the head, and the roll is still found."""
    scene = Scene(
        "brink", stick=A, effects={"pulse": Pulse(0.2, 0.002, "exit", 1)}, hand=Hand(throw_m_per_s=0.4)
    )
    slow = analyse(dataclasses.replace(scene, hand=Hand(throw_m_per_s=0.02)))
    assert slow.throw_ends == "captured"
    assert _primary(slow).v_e_m_per_s == pytest.approx(float(BY_CASE["A_stick_X"]["v_E"]), rel=1e-9)


def test_a_motion_that_never_repeats_has_no_cycles() -> None:
    scene = Scene("noisy", stick=A, effects={"pulse": Pulse(), "noise": Noise()})
    found = analyse(scene)
    assert found.cycles == ()
    assert found.note is not None
    assert "noise" in found.note
    bare = analyse(stick_cases.scene(A))
    assert found.capture_speed_m_per_s == bare.capture_speed_m_per_s
    assert (found.alpha, found.beta_measured) == (bare.alpha, bare.beta_measured)
    with pytest.raises(ValueError, match="noise never repeats"):
        roll_speeds(scene, np.array([0.2]))


def test_nothing_lost_and_nothing_given_is_no_cycle() -> None:
    """Every speed repeats: a continuum, of which rounding would otherwise make hundreds of cycles."""
    for k_coll in (1e5, 5000.0):
        lossless = stick_cases.scene(Stick(0.015, k_coll, 0.0, 20.0, 0.0, -0.02, "paper"))
        assert fixed_points(law_of(lossless), scratch_of(lossless)) == []


def test_three_speeds_over_dv() -> None:
    scene = stick_cases.scene(A, Pulse(0.2, 0.002, "exit", 1))
    found = roll_speeds(scene, np.array([0.001, 0.2, 0.5]))
    assert np.isnan([found.eq7[0], found.kappa[0], found.settled[0]]).all()
    assert list(found.period) == [0, 1, 1]
    at = analyse(scene)
    assert found.eq7[1] == pytest.approx(at.v_lc_eq7_m_per_s, rel=1e-12)
    assert found.kappa[1] == pytest.approx(at.v_lc_kappa_m_per_s, rel=1e-12)
    assert found.settled[1] == pytest.approx(float(BY_CASE["A_stick_X"]["v_E"]), rel=1e-9)
    assert found.settled[2] > found.settled[1]
    with pytest.raises(ValueError, match=r"no \[effects.pulse\]"):
        roll_speeds(stick_cases.scene(A), np.array([0.2]))


@pytest.mark.long
@settings(max_examples=25, deadline=None)
@given(any_scene.STICKS, st.none() | any_scene.PULSES)
@example(Stick(1e-4, 1e6, 1e3, 1e4, 1e3, -1.0, "paper"), Pulse(10.0, 1e-6, "exit", 1))
@example(Stick(2.6e-4, 361.0, 1e3, 0.0, 0.014, 1.0, "unilateral"), Pulse(0.026, 0.48, "turn", -1, "ignore"))
@example(
    Stick(0.009, 12746.0, 50.8, 0.0112, 960.0, -0.0028, "paper"), Pulse(4e-4, 0.46, "entry", -1, "ignore")
)
@example(Stick(1.0, 1.0, 0.0, 0.0, 0.0, 0.0, "unilateral"), None)
def test_any_values_of_the_table_are_analysed(stick: Stick, pulse: Pulse | None) -> None:
    """It ends, raises nothing, and every number in the JSON is finite; each cycle is met again by simulating it."""
    scene = stick_cases.scene(stick, pulse)
    found = analyse(scene)
    told = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert len(told["cycles"]) == len(found.cycles)
    for cycle in found.cycles:
        assert cycle.period >= 1
        assert cycle.rate_Hz > 0.0
        assert cycle.v_in_m_per_s <= 0.0
        assert cycle.apex_m >= 0.0
        assert cycle.stable == (abs(cycle.multiplier) < 1.0)
    assert (found.primary is None) == (not found.cycles)
