"""Hard contacts in closed form: overdamped, stiff, light, endless, overlapping, captured, equal eigenvalues.

Grazes stand in test_grazes.py; what a loop of fixed steps makes of such cases in test_fixed_step.py.
"""

import dataclasses
import itertools
import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import stick_cases
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick import contact
from drumstick.stick.effects.cor_pulse import CorPulse
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.simulate import COLUMNS, simulate
from stability.catalogue import shows

A = stick_cases.STICK_A
EXIT_PULSE = Pulse(0.2, 0.002, "exit", 1)


def _critical_r_in(m: float, k_coll: float) -> float:
    return 2.0 * math.sqrt(m * k_coll)


def _free(k_coll: float, r_in: float, release: str, m: float = 0.015) -> Stick:
    return Stick(m, k_coll, r_in, 0.0, 0.0, 0.0, release)  # pyright: ignore[reportArgumentType]


@shows("damping at and beyond critical", "ours")
@pytest.mark.parametrize("zeta", [1.0, 1.0 + 1e-12, 1.0 - 1e-9, 1.5, 30.0])
def test_an_overdamped_head_that_may_pull_keeps_the_stick(zeta: float) -> None:
    stick = _free(5000.0, zeta * _critical_r_in(0.015, 5000.0), "paper")
    run = simulate(stick_cases.scene(stick), 5.0, -1.0)
    assert run.end == "captured"
    assert len(run.contacts) == 0
    assert contact.beta_eq3(0.015, 5000.0, stick.r_in_N_s_per_m) == pytest.approx(0.0, abs=1e-300)


@shows("damping at and beyond critical", "ours")
@pytest.mark.parametrize("zeta", [1.0, 1.5, 30.0])
def test_an_overdamped_head_that_only_pushes_lets_go(zeta: float) -> None:
    stick = _free(5000.0, zeta * _critical_r_in(0.015, 5000.0), "unilateral")
    run = simulate(stick_cases.scene(stick), 5.0, -1.0)
    assert run.end == "left"
    beta = contact.beta_unilateral(0.015, 5000.0, stick.r_in_N_s_per_m)
    assert run.contacts[0, COLUMNS.index("v_out_m_per_s")] == pytest.approx(beta, rel=1e-9)


@shows("stiff contact", "ours")
@pytest.mark.parametrize(("m", "k_coll"), [(0.015, 1e6), (1e-4, 5000.0), (1e-4, 1e6), (1.0, 1.0)])
def test_stiff_and_light(m: float, k_coll: float) -> None:
    """Equation (3) holds to the last digits whatever the time scale of the contact."""
    r_in = 0.1 * _critical_r_in(m, k_coll)
    found = stick_cases.until(stick_cases.scene(_free(k_coll, r_in, "paper", m)), -1.0, exact.RELEASE, 100.0)
    assert found is not None
    motion, t = found
    assert motion["v_out"][0] == pytest.approx(contact.beta_eq3(m, k_coll, r_in), rel=1e-10)
    assert t == pytest.approx(contact.contact_time(contact.PAPER, m, k_coll, r_in), rel=1e-10)


@shows("stiff contact", "ours")
def test_without_any_loss_the_stick_bounces_for_ever_at_the_same_speed() -> None:
    run = simulate(stick_cases.scene(Stick(0.015, 1e6, 0.0, 20.0, 0.0, -0.02, "paper")), 100.0)
    v_out = run.contacts[:, COLUMNS.index("v_out_m_per_s")]
    assert run.end == "time"
    assert len(v_out) > 1000
    np.testing.assert_allclose(v_out, 0.4, rtol=1e-11)


@shows("pulses that overlap", "ours")
def test_a_pulse_longer_than_the_flight_still_gives_its_whole_speed() -> None:
    """tau = 0.5 s, flights of 70 ms: pulses stack into a steady push of m dv per contact."""
    scene = stick_cases.scene(A, Pulse(2.0, 0.5, "exit", 1))
    law, motion = law_of(scene), thrown(scene, 0.4)
    pushes: list[float] = []
    t = 0.0
    while t < 30.0 and motion["outcome"][0] == exact.MOVING:
        event, moved = exact.advance(law[0], motion[0], 30.0 - t)
        t += moved
        if event == exact.RELEASE:
            pushes.append(float(motion["pulse"]["acceleration"][0]))
    assert motion["outcome"][0] == exact.MOVING
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


@shows("dead roll", "ours")
def test_below_the_capture_speed_no_entry_happens_again() -> None:
    """A throw that is too slow ends in the head although each exit would bring a pulse: there is no exit."""
    scene = stick_cases.scene(A, EXIT_PULSE)
    assert simulate(scene, 10.0, -0.4).end == "time"
    dead = simulate(scene, 10.0, -1e-3)
    assert dead.end == "captured"
    assert len(dead.contacts) == 0


@pytest.mark.parametrize(
    "effects",
    [{"pulse": Pulse(0.2, 0.002, "turn", 1)}, {"cor_pulse": CorPulse(2.0, 0.002, "turn", 1)}],
    ids=["pulse", "cor_pulse"],
)
def test_a_blow_below_the_capture_speed_that_waits_for_its_pulse(effects: dict[str, Any]) -> None:
    """No tick before the deepest point may take it for captured: the pulse there throws it out again."""
    scene = Scene("case", stick=dataclasses.replace(A, z_ss_m=-0.005), effects=effects)
    slow = -0.01
    assert simulate(stick_cases.scene(scene.stick), 1.0, slow).end == "captured"
    whole = stick_cases.events(law_of(scene), thrown(scene, slow), 0.05)
    ticked = stick_cases.events(law_of(scene), thrown(scene, slow), 0.05, 1e-3)
    assert [event for event, *_ in whole[:3]] == [exact.ENTRY, exact.TURN, exact.RELEASE]
    assert [event for event, *_ in ticked] == [event for event, *_ in whole]


def test_an_overdamped_stick_that_never_turns_does_not_wait_for_its_pulse() -> None:
    """It creeps down to its rest in the head: the pulse at the deepest point never comes, and it is captured."""
    stick = Stick(0.015, 5000.0, 3.0 * _critical_r_in(0.015, 5000.0), 20.0, 0.1, -0.5, "unilateral")
    run = simulate(stick_cases.scene(stick, Pulse(1.0, 0.002, "turn", 1)), 0.5, -0.01)
    assert run.end == "captured"
    assert len(run.contacts) == 0


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


@shows("no hand", "ours")
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
    assert motion["v_out"][0] + 1e-6 * motion["pulse"]["acceleration"][0] == pytest.approx(2.0, rel=1e-3)
    assert motion["contact_s"][0] < 1e-5


def test_a_head_softer_than_the_hand() -> None:
    """R_in below R_out: a head that only pushes does not push at entry, and nothing becomes NaN."""
    run = simulate(
        stick_cases.scene(Stick(0.015, 5000.0, 0.05, 20.0, 0.4, -0.02, "unilateral"), EXIT_PULSE), 2.0
    )
    assert np.all(np.isfinite(run.contacts))
    assert len(run.contacts) > 5


def test_a_cor_pulse_above_one_multiplies_every_blow() -> None:
    """No loss above, beta + gamma > 1, and nothing that sets a scale: each contact is the one before times a factor."""
    stick = Stick(0.015, 5000.0, 1.3, 20.0, 0.0, 0.0, "paper")
    scene = Scene("case", stick=stick, effects={"cor_pulse": CorPulse(gamma=0.5)})
    run = simulate(scene, 60.0, 1e-3)
    v_e = run.contacts[:, COLUMNS.index("v_e_m_per_s")]
    assert run.end == "left"  # far beyond any stick, and before numbers overflow
    assert v_e[-1] > 1e5
    assert np.all(np.isfinite(run.contacts))
    factors = [after / before for before, after in itertools.pairwise(v_e[3:])]
    assert factors[0] > 1.2
    assert factors == pytest.approx([factors[0]] * len(factors), rel=1e-12)
    v_in, v_out = (run.contacts[3:, COLUMNS.index(name)] for name in ("v_in_m_per_s", "v_out_m_per_s"))
    np.testing.assert_allclose(v_out / v_in, (v_out / v_in)[0], rtol=1e-12)


@shows("equal eigenvalues", "ours")
@pytest.mark.parametrize(("v", "dv"), [(1.0, 2.0), (1.0, 0.25), (0.5, 8.0)])
def test_three_equal_eigenvalues(v: float, dv: float) -> None:
    """A critical contact, and a pulse that fades as fast: z = (p t^2 / 2 - v t) exp(-a t), p = a dv. Powers of 2."""
    m, a = 0.5, 512.0
    stick = Stick(m, m * a * a, 2.0 * m * a, 0.0, 0.0, 0.0, "paper")
    found = stick_cases.until(stick_cases.scene(stick, Pulse(dv, 1.0 / a, "entry", 1)), -v, exact.RELEASE)
    assert found is not None
    motion, t = found
    assert t == pytest.approx(2.0 * v / (a * dv), rel=1e-12)
    assert motion["v_out"][0] == pytest.approx(v * math.exp(-2.0 * v / dv), rel=1e-11)
    x = (1.0 + v / dv) - math.hypot(1.0, v / dv)  # a t at the deepest point
    assert motion["z_min"][0] == pytest.approx((0.5 * dv * x * x - v * x) * math.exp(-x) / a, rel=1e-12)


@shows("equal eigenvalues", "ours")
@pytest.mark.parametrize("equal", ["slow", "fast"])
@pytest.mark.parametrize("off", [0.0, 1e-14, -1e-10, 1e-6])
def test_a_pulse_that_fades_as_an_eigenvalue(equal: str, off: float) -> None:
    """An overdamped contact with eigenvalues -500 and -700 1/s, 1/tau one of them or close to it, in 50 digits."""
    slow, fast, m, v, dv = 500.0, 700.0, 0.5, 1.0, 3.0
    tau = 1.0 / ((slow if equal == "slow" else fast) * (1.0 + off))
    stick = Stick(m, m * slow * fast, m * (slow + fast), 0.0, 0.0, 0.0, "paper")
    found = stick_cases.until(stick_cases.scene(stick, Pulse(dv, tau, "entry", 1)), -v, exact.RELEASE)
    assert found is not None
    motion, t = found
    with mp.workdps(50):
        lam, p = 1 / mp.mpf(tau), mp.mpf(dv) / mp.mpf(tau)

        def free(t: mp.mpf) -> mp.mpf:
            return (mp.exp(-slow * t) - mp.exp(-fast * t)) / (fast - slow)

        def z(t: mp.mpf) -> mp.mpf:
            return mp.quad(lambda s: p * mp.exp(-lam * s) * free(t - s), [0, t]) - v * free(t)

        out = mp.findroot(z, (mp.mpf(t), mp.mpf(t) * (1 + mp.mpf(10) ** -9)), tol=mp.mpf(10) ** -60)
        speed = mp.diff(z, out)
    assert t == pytest.approx(float(out), rel=1e-12)
    assert motion["v_out"][0] == pytest.approx(float(speed), rel=1e-11)
