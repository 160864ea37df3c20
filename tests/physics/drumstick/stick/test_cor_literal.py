"""The paper's direct alteration to the letter: dv = -gamma z'(t_in)/beta, quick, at entry, into the drum."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy import integrate

import stick_cases
from drumstick.analysis.effective import effective_restitution, equation_8
from drumstick.analysis.findings import analyse
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.scene_text import SceneError, parse, shipped_text
from drumstick.scenes.table import table_of, with_changes
from drumstick.stick.effects.cor_pulse import CorPulse
from drumstick.stick.law import law_of
from drumstick.stick.simulate import simulate

LITERAL = parse(shipped_text("cor-literal"), "cor-literal")
ROLL = parse(shipped_text("roll"), "roll")
_integrate: Any = integrate  # scipy publishes no types


def _altered(scene: Scene, **changes: Any) -> Scene:
    return dataclasses.replace(
        scene, effects={"cor_pulse": dataclasses.replace(scene.effects["cor_pulse"], **changes)}
    )


def _without_hand(**changes: Any) -> Scene:
    stick = dataclasses.replace(LITERAL.stick, k_hand_N_per_m=0.0, r_out_N_s_per_m=0.0)
    return _altered(dataclasses.replace(LITERAL, stick=stick), **changes)


def _beta_eq3(scene: Scene) -> float:
    m, k, r = scene.stick.m_kg, scene.stick.k_coll_N_per_m, scene.stick.r_in_N_s_per_m
    return math.exp(-r * math.pi / math.sqrt(4.0 * m * k - r * r))


@pytest.mark.parametrize("gamma", [0.1, 0.34, 1.0])
def test_a_quick_push_makes_the_restitution_beta_and_gamma(gamma: float) -> None:
    """Restitution is beta + gamma as tau -> 0 without a hand, whatever the speed; it is missed by the square of tau."""
    limit = _beta_eq3(LITERAL) + gamma
    speeds = np.array([0.01, 1.0, 7.0])
    missed = [
        effective_restitution(_without_hand(gamma=gamma, tau_s=tau), speeds) - limit for tau in (1e-5, 1e-6)
    ]
    assert np.ptp(missed[0]) < 1e-9
    assert abs(missed[1][0]) < 1e-6 * gamma
    assert missed[0] / missed[1] == pytest.approx(100.0, rel=0.01)


def test_without_the_division_it_is_beta_times_one_and_gamma() -> None:
    gamma, beta = 0.34, _beta_eq3(LITERAL)
    found = effective_restitution(_without_hand(tau_s=1e-6, scale="speed"), np.array([1.0]))[0]
    assert found == pytest.approx(beta * (1.0 + gamma), rel=1e-3)
    assert found < beta + gamma - 0.05


def _integrated(scene: Scene, v0: float, contacts: int) -> list[list[float]]:
    # (t_in, v_in, t_out, v_out) by scipy, from equations (1), (2), (4) alone; the push is kept as its acceleration.
    stick, added = scene.stick, scene.effects["cor_pulse"]
    t, v, p, inside = 0.0, v0, 0.0, False
    rows: list[list[float]] = []
    while len(rows) < contacts or inside:
        k, r = (stick.k_coll_N_per_m, stick.r_in_N_s_per_m) if inside else (0.0, stick.r_out_N_s_per_m)

        def rates(_: float, y: Any, k: float = k, r: float = r) -> list[float]:
            z, v, p = y
            force = -k * z - r * v - stick.k_hand_N_per_m * (z - stick.z_ss_m)
            return [v, force / stick.m_kg + p, -p / added.tau_s]

        def height(t: float, y: Any) -> float:
            return y[0]

        height.terminal, height.direction = True, 1.0 if inside else -1.0  # ty: ignore[missing-attribute]  scipy looks for them
        start = [0.0, v, p]
        run = _integrate.solve_ivp(rates, (0.0, 1.0), start, "DOP853", events=height, rtol=1e-13, atol=1e-16)
        t += float(run.t_events[0][0])
        _, v, p = (float(x) for x in run.y_events[0][0])
        if inside:
            rows[-1] += [t, v]
        else:
            rows.append([t, v])
            p += v * added.gamma / _beta_eq3(scene) / added.tau_s
        inside = not inside
    return rows


def test_the_scene_is_what_another_integrator_plays() -> None:
    """Instants and speeds of the first contacts, to 1e-9."""
    expected = np.array(_integrated(LITERAL, 0.4, 8))
    found = simulate(LITERAL, float(expected[-1, 2]) + 1e-6, 0.4).contacts[:, :4]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=0.0)


def test_equation_8_at_every_cycle() -> None:
    """A roll keeps its speed where alpha beta^ is 1; with constant beta + gamma that is gamma = 1/alpha - beta."""
    cycles = analyse(LITERAL).cycles
    assert [cycle.stable for cycle in cycles] == [False, True]
    for cycle in cycles:
        found = equation_8(LITERAL, cycle)
        assert found.alpha is not None
        assert found.beta is not None
        assert found.effective_beta is not None
        assert found.factor is not None
        # 1e-6: what the flight makes of a push of which e^-19 is left at release.
        assert found.alpha * found.effective_beta == pytest.approx(1.0, rel=1e-6)
        assert found.marginal_gamma == pytest.approx(1.0 / found.alpha - found.beta, rel=1e-12)
        assert found.factor == pytest.approx(found.alpha * (found.beta + 0.34), rel=1e-12)
    assert equation_8(ROLL, analyse(ROLL).cycles[0]).factor is None


def test_a_pulse_amplifies_small_blows_and_gamma_all_of_them() -> None:
    """Section 4.2: beta^(v) of a pulse of fixed speed falls to the head's own, that of the alteration does not."""
    speeds = np.array([0.2, 5.0])
    beta = _beta_eq3(ROLL)
    small, large = effective_restitution(ROLL, speeds)
    assert small > 1.5
    assert large == pytest.approx(beta + 0.2 / 5.0, rel=0.01)
    assert np.all(effective_restitution(LITERAL, speeds) > beta + 0.25)


def test_an_overdamped_head_has_no_beta_to_divide_by() -> None:
    text = shipped_text("cor-literal").replace("r_in_N_s_per_m = 1.3", "r_in_N_s_per_m = 18.0")
    with pytest.raises(SceneError, match=r"scene:\d+: effects.cor_pulse.scale: equation \(3\) has no beta"):
        parse(text, "scene")
    parse(text.replace('"speed_over_beta"', '"speed"'), "scene")
    live = with_changes(law_of(LITERAL), table_of(LITERAL), {"r_in": 18.0})
    with pytest.raises(envelope.OutOfEnvelope, match=r"needs a beta by \(3\)"):
        envelope.require(live, envelope.Limits.of(LITERAL))
    envelope.require(law_of(LITERAL), envelope.Limits.of(LITERAL))


def test_an_overdamped_stick_that_is_played_all_the_same_gets_no_push() -> None:
    free = dataclasses.replace(stick_cases.STICK_A, k_hand_N_per_m=0.0, r_out_N_s_per_m=0.0)
    stick = dataclasses.replace(free, r_in_N_s_per_m=18.0, release="unilateral")
    still, pushed = (
        simulate(Scene("still", stick=stick, effects={"cor_pulse": effect}), 0.2, -1.0).contacts
        for effect in (CorPulse(0.0), CorPulse(0.5, scale="speed_over_beta"))
    )
    assert len(still) > 0
    np.testing.assert_array_equal(still, pushed)
