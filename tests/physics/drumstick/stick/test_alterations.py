"""Each alteration of the paper against arithmetic done another way."""

import math
from typing import Any

import numpy as np
import pytest

import stick_cases
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.safety import envelope
from drumstick.scenes.table import table_of, values_of, with_changes
from drumstick.stick.effects.chaos import Chaos
from drumstick.stick.effects.cor_pulse import CorPulse
from drumstick.stick.effects.hysteretic_spring import HystereticSpring
from drumstick.stick.effects.negative_damping import NegativeDamping
from drumstick.stick.effects.noise import Noise
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.effects.random_numbers import uniform
from drumstick.stick.effects.system_delay import SystemDelay
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.simulate import COLUMNS, simulate

M, K = 0.015, 5000.0
V_OUT, V_E, V_IN = (COLUMNS.index(name) for name in ("v_out_m_per_s", "v_e_m_per_s", "v_in_m_per_s"))


def _scene(r_in: float = 0.0, release: str = "paper", m: float = M, k: float = K, **effects: Any) -> Scene:
    """A stick without a hand, so that nothing but the contact acts."""
    return Scene("case", stick=Stick(m, k, r_in, 0.0, 0.0, 0.0, release), effects=effects)  # pyright: ignore


def _rebound(scene: Scene, speed: float = 1.0) -> float:
    found = stick_cases.until(scene, -speed, exact.RELEASE)
    assert found is not None
    return float(found[0]["v_out"][0]) / speed


@pytest.mark.parametrize("ratio", [1.0, 1.21, 2.25, 4.0])
@pytest.mark.parametrize("release", ["paper", "unilateral"])
def test_hysteretic_spring_gives_back_the_root_of_its_ratio(ratio: float, release: str) -> None:
    scene = _scene(release=release, hysteretic_spring=HystereticSpring(ratio))
    assert _rebound(scene) == pytest.approx(math.sqrt(ratio), rel=1e-12)


def test_hysteretic_spring_with_damping_is_two_quarter_swings() -> None:
    """Down with K to z_min, up from rest with 1.5 K: each in closed form, joined at the turn."""
    r_in, ratio = 1.3, 1.5
    a = r_in / (2.0 * M)
    w1, w2 = (math.sqrt(k / M - a * a) for k in (K, ratio * K))
    turn = math.atan2(w1, a) / w1
    depth = math.exp(-a * turn) * math.sin(w1 * turn) / w1
    # z = -depth e^(-a t)(cos + a/w sin), zero where tan(w t) = -w/a; its speed there.
    rise = (math.pi - math.atan2(w2, a)) / w2
    speed = depth * (a * a + w2 * w2) / w2 * math.exp(-a * rise) * math.sin(w2 * rise)
    scene = _scene(r_in=r_in, hysteretic_spring=HystereticSpring(ratio))
    assert _rebound(scene) == pytest.approx(speed, rel=1e-11)


def test_negative_damping_multiplies_below_its_speed_only() -> None:
    scene = _scene(r_in=1.3, negative_damping=NegativeDamping(r_N_s_per_m=2.0, below_m_per_s=0.5))
    zeta = (1.3 - 2.0) / (2.0 * math.sqrt(M * K))
    grown = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))
    assert grown > 1.1
    assert _rebound(scene, 0.499) == pytest.approx(grown, rel=1e-11)
    ordinary = _rebound(_scene(r_in=1.3))
    assert _rebound(scene, 0.5) == pytest.approx(ordinary, rel=1e-12)


def test_negative_damping_is_bounded_however_large() -> None:
    scene = _scene(r_in=0.0, negative_damping=NegativeDamping(r_N_s_per_m=1e3, below_m_per_s=10.0))
    assert _rebound(scene) == pytest.approx(math.exp(math.pi / math.sqrt(3.0)), rel=1e-11)


@pytest.mark.parametrize("gamma", [0.0, 0.15, 1.0])
def test_cor_pulse_adds_to_the_coefficient_of_restitution(gamma: float) -> None:
    """Equation (8): v_E = (beta + gamma) |v_in|, at any speed."""
    beta = _rebound(_scene(r_in=1.3))
    for speed in (0.01, 1.0, 7.0):
        scene = _scene(r_in=1.3, cor_pulse=CorPulse(gamma, 1e-3))
        found = stick_cases.until(scene, -speed, exact.RELEASE)
        assert found is not None
        motion = found[0][0]
        v_e = motion["v_out"] + motion["cor_pulse"]["acceleration"] * 1e-3
        assert v_e / speed == pytest.approx(beta + gamma, rel=1e-11)


def test_two_pulses_with_two_lengths_add() -> None:
    """Above the head, next to no hand: each pulse alone gives its own speed, together they give both."""
    scene = Scene(
        "both",
        stick=Stick(M, K, 1.3, 1e-9, 0.0, -1e-3, "paper"),
        effects={"pulse": Pulse(0.3, 0.002, "exit", 1), "cor_pulse": CorPulse(0.2, 0.03)},
    )
    law, motion = law_of(scene), thrown(scene, -1.0)
    stick_cases.advance_by(law, motion, 0.02)
    out = float(motion["v_out"][0])
    gone = 0.02 - float(motion["contact_s"][0])
    speed = out + 0.3 * -math.expm1(-gone / 0.002) + 0.2 * -math.expm1(-gone / 0.03)
    assert motion["v"][0] == pytest.approx(speed, rel=1e-8)
    names = set(table_of(scene))
    assert {"tau", "cor_pulse.tau", "dv_pls", "gamma"} <= names
    changed = with_changes(law, table_of(scene), {"tau": 0.004, "cor_pulse.tau": 0.05})
    found = values_of(changed, table_of(scene))
    assert (found["tau"], found["cor_pulse.tau"]) == (0.004, 0.05)
    assert changed["pulse"]["tau"][0] == 0.004


def _sampled_rebound(m: float, k: float, r: float, period: float, ticks: int, wait: float) -> float:
    """A falling mass under a held force that comes late, step by step: 1 m/s in, out once nothing pushes any more."""
    z, v, queue = -wait, -1.0, [0.0] * ticks
    for _ in range(100_000):
        push = max(0.0, -k * z - r * v) if z < 0.0 else 0.0
        queue.append(push)
        a = queue.pop(0) / m
        if z >= 0.0 and v > 0.0 and a == 0.0 and not any(queue):
            return v
        z, v = z + v * period + 0.5 * a * period * period, v + a * period
    raise AssertionError("it never left")


@pytest.mark.parametrize(("ticks", "period"), [(0, 1e-3), (1, 1e-3), (3, 5e-4), (8, 1e-4)])
def test_system_delay_is_a_sampled_system(ticks: int, period: float) -> None:
    m, k, r = 0.1, 2000.0, 2.0
    for phase in (0.0, 0.3, 0.9):
        scene = _scene(r, "unilateral", m, k, system_delay=SystemDelay(period, ticks))
        law, motion = law_of(scene), thrown(scene, -1.0)
        motion["system_delay"]["left_s"] = phase * period if phase else 0.0
        stick_cases.advance_by(law, motion, 0.2)
        expected = _sampled_rebound(m, k, r, period, ticks, phase * period)
        assert motion["v"][0] == pytest.approx(expected, rel=1e-9)


def test_system_delay_rebounds_faster_than_the_blow_and_depends_on_the_phase() -> None:
    """0.1 kg on 2000 N/m at 1 kHz with a tick of delay."""
    found = [
        _sampled_rebound(0.1, 2000.0, 2.0, 1e-3, 1, phase * 1e-3) for phase in np.linspace(0.0, 0.99, 34)
    ]
    assert min(found) > 1.05
    assert max(found) - min(found) > 0.005
    fine = _sampled_rebound(0.1, 2000.0, 6.0, 1e-5, 8, 0.0)
    effective = 6.0 - 2000.0 * 8.5e-5
    zeta = effective / (2.0 * math.sqrt(0.1 * 2000.0))
    lag = math.exp(-2.0 * zeta * math.acos(zeta) / math.sqrt(1.0 - zeta * zeta))
    assert fine == pytest.approx(lag, rel=0.01)


def test_noise_repeats_by_its_seed_and_not_by_the_split() -> None:
    stick = stick_cases.STICK_A

    def contacts(seed: int) -> np.ndarray:
        scene = Scene("noisy", stick=stick, effects={"noise": Noise(1.0, 1e-3, seed)})
        return simulate(scene, 2.0).contacts

    np.testing.assert_array_equal(contacts(7), contacts(7))
    assert not np.array_equal(contacts(7)[:5], contacts(8)[:5])
    scene = Scene("noisy", stick=stick, effects={"noise": Noise(1.0, 1e-3, 7)})
    whole = stick_cases.events(law_of(scene), thrown(scene, 0.4), 0.3)
    ticks = stick_cases.events(law_of(scene), thrown(scene, 0.4), 0.3, 1e-3)
    assert [e[0] for e in whole] == [e[0] for e in ticks]
    np.testing.assert_allclose([e[1] for e in ticks], [e[1] for e in whole], rtol=1e-9)


def test_noise_is_uniform_and_without_memory() -> None:
    drawn = np.array([uniform(3, i) for i in range(200_000)])
    assert drawn.min() >= 0.0
    assert drawn.max() < 1.0
    counts = np.histogram(drawn, 100, (0.0, 1.0))[0]
    assert np.sum((counts - 2000.0) ** 2 / 2000.0) < 150.0  # chi-square with 99 degrees: 149 at p = 0.001
    for lag in (1, 2, 7):
        assert abs(np.corrcoef(drawn[:-lag], drawn[lag:])[0, 1]) < 0.01


def test_chaos_follows_the_logistic_map() -> None:
    scene = Scene("chaos", stick=stick_cases.STICK_A, effects={"chaos": Chaos(2.0, 3.9, 0.4)})
    law, motion = law_of(scene), thrown(scene, 0.4)
    found, gone = [], 0.0
    while len(found) < 30 and gone < 10.0:
        event, moved = exact.advance(law[0], motion[0], 10.0 - gone)
        gone += moved
        if event == exact.RELEASE:
            found.append(float(motion["chaos"]["x"][0]))
    x, expected = 0.4, []
    for _ in found:
        x = 3.9 * x * (1.0 - x)
        expected.append(x)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert len(found) == 30


def test_chaos_gives_the_work_of_its_force() -> None:
    """Undamped, without a hand: from z_min to 0 the head does F |z_min| more, and v_out follows from energy."""
    scene = _scene(chaos=Chaos(3.0, 4.0, 0.5))  # x becomes 1
    found = stick_cases.until(scene, -1.0, exact.RELEASE)
    assert found is not None
    depth = math.sqrt(M / K)
    assert found[0]["v_out"][0] == pytest.approx(math.sqrt(1.0 + 2.0 * 3.0 * depth / M), rel=1e-11)


def test_a_cor_pulse_above_one_leaves_before_numbers_overflow() -> None:
    scene = Scene("mad", stick=stick_cases.STICK_A, effects={"cor_pulse": CorPulse(2.0, 1e-3)})
    run = simulate(scene, 1e4)
    assert run.end == "left"
    assert np.all(np.isfinite(run.contacts))
    assert run.contacts[-1, V_E] > 1e5
    limits = envelope.Limits(100.0, 10.0).record()
    code = envelope.judge(law_of(scene)[0], limits[0], envelope.new_scratch()).code
    assert code == envelope.ENDLESS


@pytest.mark.parametrize("gamma", [0.36, 0.38, 0.42])
def test_the_envelope_bounds_a_cor_roll_that_only_the_hand_ends(gamma: float) -> None:
    """beta + gamma is above 1 here: alpha(v) ends the growth, below the bound."""
    scene = Scene("cor", stick=stick_cases.STICK_A, effects={"cor_pulse": CorPulse(gamma, 2e-3)})
    bound, _ = envelope.predicted(law_of(scene)[0], 0.0)
    run = simulate(scene, 60.0)
    assert run.end == "time"
    settled = run.contacts[-1, V_E]
    assert 0.5 < settled < bound < 3.0 * settled
