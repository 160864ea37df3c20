"""Cases that break ordinary integrators, by name."""

import math

import numpy as np
import pytest

import stick_cases
from drumstick import contact, exact
from drumstick.effects.pulse import Pulse
from drumstick.law import law_of, thrown
from drumstick.simulate import COLUMNS, simulate
from drumstick.stick import Stick

A = stick_cases.STICK_A
EXIT_PULSE = Pulse(0.2, 0.002, "exit", 1)


def _critical_r_in(m: float, k_coll: float) -> float:
    return 2.0 * math.sqrt(m * k_coll)


def _free(k_coll: float, r_in: float, release: str, m: float = 0.015) -> Stick:
    return Stick(m, k_coll, r_in, 0.0, 0.0, 0.0, release)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("zeta", [1.0, 1.0 + 1e-12, 1.0 - 1e-9, 1.5, 30.0])
def test_an_overdamped_head_that_may_pull_keeps_the_stick(zeta: float) -> None:
    stick = _free(5000.0, zeta * _critical_r_in(0.015, 5000.0), "paper")
    run = simulate(stick_cases.scene(stick), 5.0, -1.0)
    assert run.end == "captured"
    assert len(run.contacts) == 0
    assert contact.beta_eq3(0.015, 5000.0, stick.r_in_N_s_per_m) == pytest.approx(0.0, abs=1e-300)


@pytest.mark.parametrize("zeta", [1.0, 1.5, 30.0])
def test_an_overdamped_head_that_only_pushes_lets_go(zeta: float) -> None:
    stick = _free(5000.0, zeta * _critical_r_in(0.015, 5000.0), "unilateral")
    run = simulate(stick_cases.scene(stick), 5.0, -1.0)
    assert run.end == "left"
    beta = contact.beta_unilateral(0.015, 5000.0, stick.r_in_N_s_per_m)
    assert run.contacts[0, COLUMNS.index("v_out_m_per_s")] == pytest.approx(beta, rel=1e-9)


@pytest.mark.parametrize(("m", "k_coll"), [(0.015, 1e6), (1e-4, 5000.0), (1e-4, 1e6), (1.0, 1.0)])
def test_stiff_and_light(m: float, k_coll: float) -> None:
    """Equation (3) holds to the last digits whatever the time scale of the contact."""
    r_in = 0.1 * _critical_r_in(m, k_coll)
    found = stick_cases.until(stick_cases.scene(_free(k_coll, r_in, "paper", m)), -1.0, exact.RELEASE, 100.0)
    assert found is not None
    motion, t = found
    assert motion["v_out"][0] == pytest.approx(contact.beta_eq3(m, k_coll, r_in), rel=1e-10)
    assert t == pytest.approx(contact.contact_time(contact.PAPER, m, k_coll, r_in), rel=1e-10)


def test_without_any_loss_the_stick_bounces_for_ever_at_the_same_speed() -> None:
    run = simulate(stick_cases.scene(Stick(0.015, 1e6, 0.0, 20.0, 0.0, -0.02, "paper")), 100.0)
    v_out = run.contacts[:, COLUMNS.index("v_out_m_per_s")]
    assert run.end == "time"
    assert len(v_out) > 1000
    np.testing.assert_allclose(v_out, 0.4, rtol=1e-11)


def test_a_pulse_longer_than_the_flight_still_gives_its_whole_speed() -> None:
    """tau = 0.5 s, flights of 70 ms: pulses stack into a steady push of m dv per contact."""
    scene = stick_cases.scene(A, Pulse(2.0, 0.5, "exit", 1))
    law, motion = law_of(scene), thrown(scene, 0.4)
    pushes: list[float] = []
    t = 0.0
    while t < 30.0 and motion["fate"][0] == exact.MOVING:
        event, moved = exact.advance(law[0], motion[0], 30.0 - t)
        t += moved
        if event == exact.RELEASE:
            pushes.append(float(motion["pulse"]["push"][0]))
    assert motion["fate"][0] == exact.MOVING
    # Just after a pulse: dv/tau of its own and what is left of all before, a geometric series at this roll's period.
    contacts = simulate(scene, 30.0).contacts
    period = contacts[-1, 2] - contacts[-2, 2]
    assert pushes[-1] == pytest.approx(2.0 / 0.5 / -math.expm1(-period / 0.5), rel=1e-6)


def test_without_a_pulse_the_stick_comes_to_rest_in_the_head() -> None:
    for scene in (stick_cases.scene(A), stick_cases.scene(A, Pulse(0.0, 0.002, "exit", 1))):
        run = simulate(scene, 60.0)
        assert run.end == "captured"
        assert run.t_end_s < 2.0
        assert 3 < len(run.contacts) < 200
        assert np.all(np.diff(run.contacts[:, COLUMNS.index("v_e_m_per_s")]) < 0.0)


def test_below_the_capture_speed_no_entry_happens_again() -> None:
    """A throw that is too slow ends in the head although each exit would bring a pulse: there is no exit."""
    scene = stick_cases.scene(A, EXIT_PULSE)
    assert simulate(scene, 10.0, -0.4).end == "time"
    dead = simulate(scene, 10.0, -1e-3)
    assert dead.end == "captured"
    assert len(dead.contacts) == 0


def test_a_hand_that_holds_the_stick_above_the_head_takes_it_away() -> None:
    held = Stick(0.015, 5000.0, 1.3, 20.0, 0.1, 0.05, "paper")
    run = simulate(stick_cases.scene(held, EXIT_PULSE), 60.0, -1.0)
    assert run.end == "left"
    assert len(run.contacts) >= 1


def test_z_ss_above_the_head_is_not_always_no_return() -> None:
    """Loosely held a little above the head and thrown hard, the stick swings back to it several times."""
    held = Stick(0.015, 5000.0, 0.2, 20.0, 0.02, 0.005, "paper")
    run = simulate(stick_cases.scene(held), 60.0, -2.0)
    assert run.end == "left"
    assert len(run.contacts) > 5


def test_no_hand_at_all_is_one_contact_and_away() -> None:
    run = simulate(stick_cases.scene(_free(5000.0, 1.3, "paper"), EXIT_PULSE), 60.0, -0.5)
    assert run.end == "left"
    assert len(run.contacts) == 1


def test_a_start_inside_the_head() -> None:
    """v0 < 0 begins with a contact at t = 0 whose entry speed is v0."""
    run = simulate(stick_cases.scene(A, EXIT_PULSE), 1.0, -0.7)
    assert run.contacts[0, COLUMNS.index("t_in_s")] == pytest.approx(0.0, abs=1e-12)
    assert run.contacts[0, COLUMNS.index("v_in_m_per_s")] == -0.7


def test_a_throw_at_rest_falls_onto_the_head() -> None:
    """v0 = 0 with the hand pressing down: contact at once, and rest."""
    run = simulate(stick_cases.scene(A), 1.0, 0.0)
    assert run.end == "captured"


def test_a_pulse_that_throws_the_stick_back_before_it_compresses_the_head() -> None:
    """Quick and strong, up at entry: v_E = dv - |v_in|, whatever the head is made of."""
    found = stick_cases.until(
        stick_cases.scene(_free(5000.0, 1.3, "paper"), Pulse(3.0, 1e-6, "entry", 1)), -1.0, exact.RELEASE
    )
    assert found is not None
    motion, _ = found
    assert motion["v_out"][0] + 1e-6 * motion["pulse"]["push"][0] == pytest.approx(2.0, rel=1e-3)
    assert motion["contact_s"][0] < 1e-5


def test_a_head_softer_than_the_hand() -> None:
    """R_in below R_out: a head that only pushes does not push at entry, and nothing becomes NaN."""
    run = simulate(
        stick_cases.scene(Stick(0.015, 5000.0, 0.05, 20.0, 0.4, -0.02, "unilateral"), EXIT_PULSE), 2.0
    )
    assert np.all(np.isfinite(run.contacts))
    assert len(run.contacts) > 5
