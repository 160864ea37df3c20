"""The stick beside a loop of fixed steps of a millisecond, as force loops have it: an event counts when it was seen."""

import itertools
import math

import numpy as np
import pytest

import stick_cases
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.methods.carry import STEPPERS
from drumstick.stick.simulate import COLUMNS, Stepper, simulate
from stability.catalogue import shows

TICK_S = 1e-3
EULER = Stepper("semi_implicit_euler", TICK_S, locates=False)
A = stick_cases.STICK_A
V_OUT, V_E = COLUMNS.index("v_out_m_per_s"), COLUMNS.index("v_e_m_per_s")


@shows("stiff contact")
@pytest.mark.parametrize("method", STEPPERS)
def test_a_stiff_contact_throws_a_fixed_step_out_and_keeps_the_speed_of_ours(method: str) -> None:
    """K_coll = 1e6 N/m: a contact of 0.4 ms, without any loss."""
    scene = stick_cases.scene(Stick(0.015, 1e6, 0.0, 20.0, 0.0, -0.02, "paper"))
    naive = simulate(scene, 5.0, 0.4, Stepper(method, TICK_S, locates=False))
    assert np.max(np.abs(naive.contacts[:, V_OUT])) > 3.0 * 0.4
    assert naive.end == "left"  # faster than any stick
    ours = simulate(scene, 5.0, 0.4)
    assert ours.end == "time"
    assert len(ours.contacts) > 100
    np.testing.assert_allclose(ours.contacts[:, V_OUT], 0.4, rtol=1e-11)


@shows("dead roll")
def test_a_blow_that_stays_in_the_head_is_no_roll() -> None:
    """Slower than the capture speed. A fixed step leaves by energy that it has made, and each exit brings a pulse."""
    scene = stick_cases.scene(A, Pulse(0.2, 0.002, "exit", 1))
    naive, ours = simulate(scene, 5.0, -0.05, EULER), simulate(scene, 5.0, -0.05)
    assert (naive.end, len(naive.contacts) > 90) == ("time", True)
    assert (ours.end, len(ours.contacts)) == ("captured", 0)


@shows("pulse shorter than a step")
@pytest.mark.parametrize("tau_s", [1e-4, 1e-5, 1e-6])
def test_a_pulse_shorter_than_a_step_gives_its_speed_and_no_more(tau_s: float) -> None:
    """Held over a step, a force of m dv/tau gives dv T/tau. A shorter pulse is the same blow: v_E hardly changes."""
    scene = stick_cases.scene(A, Pulse(0.2, tau_s, "exit", 1))
    settled = simulate(stick_cases.scene(A, Pulse(0.2, 1e-7, "exit", 1)), 10.0).contacts[-1, V_E]
    naive, ours = (simulate(scene, 10.0, stepper=method).contacts[-1, V_E] for method in (EULER, None))
    assert naive > 4.0 * settled
    assert ours == pytest.approx(settled, rel=30.0 * tau_s)


@shows("pulses that overlap")
def test_pulses_that_overlap_add_and_a_loop_with_one_pulse_loses_the_rest() -> None:
    """tau of half a second, seven contacts long: the sum of what is left of each, a geometric series."""
    one_at_a_time, ours = (
        simulate(stick_cases.scene(A, Pulse(2.0, 0.5, "exit", 1, overlap)), 30.0).contacts
        for overlap in ("replace", "add")
    )
    assert one_at_a_time[-1, V_E] < 0.5 * ours[-1, V_E]
    # In the steady state each contact takes what a pulse gives, and all that is left of the earlier ones comes on top.
    period = ours[-1, 2] - ours[-2, 2]
    left = ours[-1, V_E] - ours[-1, V_OUT]
    assert left == pytest.approx(2.0 / -math.expm1(-period / 0.5), rel=1e-6)


@shows("no hand")
def test_without_a_hand_the_usual_closed_form_has_no_number() -> None:
    """z = g/w^2 + (z0 - g/w^2) cos w t + v/w sin w t, with w -> 0 the stick's own weight in free flight."""
    m, z0, v, t = 0.015, 0.0, 0.3, 0.1

    def naive(k_hand: float, z_ss: float) -> float:
        with np.errstate(all="ignore"):
            w = np.sqrt(np.float64(k_hand) / m)
            g = w * w * z_ss
            return float(g / w**2 + (z0 - g / w**2) * np.cos(w * t) + v / w * np.sin(w * t))

    assert math.isnan(naive(0.0, -1.0))
    for k_hand in (0.0, 1e-300, 1e-12, 1e-3):
        scene = stick_cases.scene(Stick(m, 5000.0, 1.3, k_hand, 0.0, -1.0, "paper"))
        law, motion = stick_cases.law_of(scene), stick_cases.thrown(scene, v)
        stick_cases.advance_by(law, motion, t)
        right = v * t - 0.5 * k_hand / m * t * t if k_hand < 1e-6 else naive(k_hand, -1.0)
        assert motion["z"][0] == pytest.approx(right, rel=1e-13)
    run = simulate(stick_cases.scene(Stick(m, 5000.0, 1.3, 0.0, 0.0, 0.0, "paper")), 60.0, -0.5)
    assert (run.end, len(run.contacts)) == ("left", 1)


@shows("damping at and beyond critical")
@pytest.mark.parametrize("zeta", [1.0, 1.0 + 1e-12, 1.5])
def test_the_usual_formulas_have_no_number_at_critical_damping_and_beyond(zeta: float) -> None:
    """beta = exp(-2 zeta acos(zeta)/sqrt(1 - zeta^2)) and the contact's w_d."""
    m, k = 0.015, 5000.0
    with np.errstate(all="ignore"):
        z = np.float64(zeta)
        assert math.isnan(np.exp(-2.0 * z * np.arccos(z) / np.sqrt(1.0 - z * z)))
    stick = Stick(m, k, zeta * 2.0 * math.sqrt(m * k), 0.0, 0.0, 0.0, "unilateral")
    run = simulate(stick_cases.scene(stick), 5.0, -1.0)
    beyond = math.acosh(zeta) / math.sqrt(zeta * zeta - 1.0) if zeta > 1.0 else 1.0
    assert run.contacts[0, V_OUT] == pytest.approx(math.exp(-2.0 * zeta * beyond), rel=1e-6)


@shows("equal eigenvalues")
@pytest.mark.parametrize("off", [0.0, 1e-14, 1e-9, 1e-6])
def test_partial_fractions_cancel_where_the_pulse_fades_as_the_contact_does(off: float) -> None:
    """A critical contact, eigenvalue -a twice, and 1/tau = a (1 + off): z = (a dv t^2/2 - v t) exp(-a t) at 0."""
    m, a, v, dv = 0.5, 512.0, 1.0, 2.0
    rate = a * (1.0 + off)
    t = 2.0 * v / (a * dv)  # where it leaves, for off = 0

    def naive() -> float:
        with np.errstate(all="ignore"):
            away = np.float64(a) - rate
            push = dv * rate
            alone = push / away**2 * (np.exp(-rate * t) - np.exp(-a * t) - away * t * np.exp(-a * t))
            return float((alone - v * t * np.exp(-a * t)) * a)

    stick = Stick(m, m * a * a, 2.0 * m * a, 0.0, 0.0, 0.0, "paper")
    scene = Scene("case", stick=stick, effects={"pulse": Pulse(dv, 1.0 / rate, "entry", 1)})
    law, motion = stick_cases.law_of(scene), stick_cases.thrown(scene, -v)
    stick_cases.advance_by(law, motion, 0.5 * t)
    half = 0.5 * t
    series = 0.5 * half**2 - (rate - a) * half**3 / 6.0  # (e^-ut - e^-at + ...)/(a - rate)^2, two terms of it
    right = (dv * rate * series - v * half) * math.exp(-a * half)
    assert motion["z"][0] == pytest.approx(right, rel=1e-11)
    if off <= 1e-9:
        wrong = naive()
        assert not abs(wrong) < 1e-9  # it is 0 there


NAIVE_SETS = list(itertools.product((1e-4, 0.015, 1.0), (1.0, 5e3, 1e6), (0.0, 20.0, 200.0), (-0.5, -0.02)))


@shows("any numbers of the tables")
def test_of_undamped_sets_a_fixed_step_makes_energy_in_most_and_ours_in_none() -> None:
    """Three decades of mass, six of stiffness: only where a contact has many steps a fixed step keeps the speed."""
    gains = played = 0
    for m, k_coll, k_hand, z_ss in NAIVE_SETS:
        scene = stick_cases.scene(Stick(m, k_coll, 0.0, k_hand, 0.0, z_ss, "paper"))
        naive, ours = simulate(scene, 0.2, -0.4, EULER).contacts, simulate(scene, 0.2, -0.4).contacts
        assert np.all(ours[:, V_OUT] <= 0.4 * (1.0 + 1e-9))
        played += len(ours) > 0
        gains += len(naive) > 0 and not np.max(np.abs(naive[:, V_OUT])) < 0.44
    assert gains > 0.5 * played  # a tenth of the speed is a fifth of the energy
