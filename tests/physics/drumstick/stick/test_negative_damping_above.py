"""Negative damping of R_out, above the head: a flight that gains, while it begins slower than a limit."""

import dataclasses
import math
from typing import Any, Literal

import numpy as np
import pytest
from scipy import integrate

import stick_cases
from drumstick.analysis.flight import flight
from drumstick.analysis.rebound import capture_speed
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.safety import bounds, envelope
from drumstick.safety.entry_speed import speed_ahead
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.effects.negative_damping import NegativeDamping
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.effects.system_delay import SystemDelay
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.simulate import simulate
from drumstick.stick.trajectory import trajectory

GAINING = parse(shipped_text("gaining-flight"), "gaining-flight")
PULSE = Pulse(0.12, 0.002, "exit", 1)
_integrate: Any = integrate  # scipy publishes no types
Release = Literal["paper", "unilateral"]


def _scene(
    z_ss: float, r: float = 0.4, below: float = 0.5, release: Release = "paper", pulse: Pulse | None = None
) -> Scene:
    stick = dataclasses.replace(stick_cases.STICK_A, z_ss_m=z_ss, release=release)
    effects: dict[str, Any] = {"negative_damping": NegativeDamping(r, below, "above")}
    return Scene("above", stick=stick, effects=effects | ({"pulse": pulse} if pulse else {}))


class _Integrated:
    """The stick by scipy, from the paper's equations alone; r_out is what the flight was given at its start."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.stick = scene, scene.stick
        self.t, self.z, self.v, self.p = 0.0, 0.0, 0.0, 0.0

    def go(self, k: float, r: float, end: Any, direction: float) -> None:
        """On to where `end`(z, v) reaches 0, with the head's or no spring, and this damping in all."""
        stick, pulse = self.stick, self.scene.effects.get("pulse")
        tau = pulse.tau_s if pulse else 1.0

        def rates(_: float, y: Any) -> list[float]:
            z, v, p = y
            force = -k * z - r * v - stick.k_hand_N_per_m * (z - stick.z_ss_m)
            return [v, force / stick.m_kg + p, -p / tau]

        def ends(t: float, y: Any) -> float:
            return end(y[0], y[1])

        ends.terminal, ends.direction = True, direction  # ty: ignore[missing-attribute]  scipy looks for them
        run = _integrate.solve_ivp(
            rates, (0.0, 60.0), [self.z, self.v, self.p], "DOP853", events=ends, rtol=1e-13, atol=1e-16
        )
        self.t += float(run.t_events[0][0])
        self.z, self.v, self.p = (float(x) for x in run.y_events[0][0])

    def contacts(self, v0: float, count: int) -> list[list[float]]:
        """(t_in, v_in, t_out, v_out) of the first contacts."""
        stick, own, pulse = (
            self.stick,
            self.scene.effects["negative_damping"],
            self.scene.effects.get("pulse"),
        )
        lowered = max(stick.r_out_N_s_per_m - own.r_N_s_per_m, -math.sqrt(stick.m_kg * stick.k_hand_N_per_m))
        own_r = stick.r_in_N_s_per_m - stick.r_out_N_s_per_m
        self.v = v0
        rows: list[list[float]] = []
        for _ in range(count):
            self.z = 0.0
            self.go(
                0.0, lowered if self.v < own.below_m_per_s else stick.r_out_N_s_per_m, lambda z, v: z, -1.0
            )
            row, self.z = [self.t, self.v], 0.0
            if stick.release == "unilateral":
                self.go(
                    stick.k_coll_N_per_m,
                    stick.r_in_N_s_per_m,
                    lambda z, v: -stick.k_coll_N_per_m * z - own_r * v,
                    -1.0,
                )
                self.go(0.0, stick.r_out_N_s_per_m, lambda z, v: z, 1.0)
            else:
                self.go(stick.k_coll_N_per_m, stick.r_in_N_s_per_m, lambda z, v: z, 1.0)
            rows.append([*row, self.t, self.v])
            self.p += pulse.dv_m_per_s / pulse.tau_s if pulse else 0.0
        return rows


@pytest.mark.parametrize(
    "scene",
    [
        _scene(-0.02),
        _scene(-0.02, release="unilateral"),
        _scene(-0.02, r=9.0),
        _scene(-0.012, r=0.05),
        _scene(0.0, r=0.3),
        _scene(0.01, r=0.6),
        _scene(-0.02, pulse=PULSE),
        _scene(0.004, r=0.25, pulse=PULSE, release="unilateral"),
        GAINING,
    ],
    ids=[
        "presses",
        "unilateral",
        "bounded",
        "loses less",
        "no pull",
        "lifts",
        "pulse",
        "pulse, lifts",
        "shipped",
    ],
)
def test_another_integrator_plays_the_same(scene: Scene) -> None:
    """Instants and speeds of the first contacts, to 1e-9; where the hand lifts one flight turns many times."""
    expected = np.array(_Integrated(scene).contacts(0.3, 5))
    found = simulate(scene, float(expected[-1, 2]) + 1e-6, 0.3).contacts[:, :4]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=0.0)


def test_a_slow_flight_gains_and_a_fast_one_does_not() -> None:
    """No pull: half a swing, whatever the speed."""
    scene = _scene(0.0, r=0.3)
    m, k, r = scene.stick.m_kg, scene.stick.k_hand_N_per_m, 0.1 - 0.3
    grown = math.exp(-math.pi * r / math.sqrt(4.0 * m * k - r * r))
    assert grown > 1.5
    for speed in (1e-3, 0.499):
        found = flight(scene, speed)
        assert found is not None
        assert found.alpha == pytest.approx(grown, rel=1e-12)
    ordinary = dataclasses.replace(scene, effects={})
    assert flight(scene, 0.5) == flight(ordinary, 0.5)


def test_it_is_bounded_however_large() -> None:
    found = flight(_scene(0.0, r=1e3, below=10.0), 1.0)
    assert found is not None
    assert found.alpha == pytest.approx(math.exp(math.pi / math.sqrt(3.0)), rel=1e-12)


def test_without_a_hand_nothing_becomes_negative() -> None:
    """A stick that nothing brings back: r_out falls to 0, and it leaves as fast as it was thrown."""
    stick = dataclasses.replace(stick_cases.STICK_A, k_hand_N_per_m=0.0, z_ss_m=0.0)
    scene = Scene("free", stick=stick, effects={"negative_damping": NegativeDamping(5.0, 1.0, "above")})
    run = trajectory(scene, 0.4, 2.0, 5)
    np.testing.assert_allclose(run.v_m_per_s, 0.4, rtol=1e-14)


def test_the_head_is_as_without_it() -> None:
    """Contacts keep their R_in, and the hand its R_out in the head: a slow blow ends as without the effect."""
    slow, ordinary = _scene(-0.02), dataclasses.replace(_scene(-0.02), effects={})
    found = [stick_cases.until(scene, -0.3, exact.RELEASE) for scene in (slow, ordinary)]
    assert found[0] is not None
    assert found[1] is not None
    for name in ("v_out", "peak_N", "impulse_N_s", "contact_s", "z_min"):
        assert found[0][0][name][0] == found[1][0][name][0]
    assert capture_speed(slow) == capture_speed(ordinary)


def test_a_hand_that_lifts_does_not_keep_a_stick_that_gains() -> None:
    """0.2 m/s swings 5 mm about a rest 10 mm above the head: never back, but for the growth."""
    scene = _scene(0.01, r=0.6)
    ordinary = dataclasses.replace(scene, effects={})
    assert simulate(ordinary, 5.0, 0.2).end == "left"
    assert len(simulate(scene, 5.0, 0.2).contacts) > 10


def test_the_scene_rolls_by_its_flights_alone() -> None:
    """No pulse: speeds stay below what the envelope says, and the roll does not die."""
    law = law_of(GAINING)
    speed, force = envelope.predicted(law[0], GAINING.hand.throw_m_per_s)
    run = simulate(GAINING, 20.0)
    assert run.end == "time"
    assert 20.0 < len(run.contacts) / 20.0 < 30.0
    assert np.abs(run.contacts[:, 1]).max() <= speed
    assert run.contacts[:, 5].max() <= force
    assert simulate(dataclasses.replace(GAINING, effects={}), 20.0).end == "captured"


def _law_and_bound(rng: np.random.Generator) -> tuple[Scene, float] | None:
    # Of what the envelope lets pass, with limits that few sets come near.
    m, k_hand = float(rng.uniform(0.005, 0.05)), float(np.exp(rng.uniform(0.0, 6.0)))
    own = math.sqrt(m * k_hand)
    r_out = float(own * rng.choice([0.0, 0.05, 0.3]))
    stick = Stick(
        m, 5000.0, r_out + float(rng.uniform(0.3, 3.0)), k_hand, r_out,
        float(rng.choice([-1.0, -0.1, 0.0, 0.1, 1.0]) * np.exp(rng.uniform(-8.0, -3.0))), "unilateral",
    )  # fmt: skip
    effects: dict[str, Any] = {
        "pulse": Pulse(
            float(rng.choice([0.0, 1.0]) * np.exp(rng.uniform(-5.0, 0.0))), float(np.exp(rng.uniform(-8.0, 0.0))),
            str(rng.choice(["entry", "turn", "exit"])), int(rng.choice([1, -1])),  # pyright: ignore[reportArgumentType]
        ),
        "negative_damping": NegativeDamping(
            float(own * rng.uniform(0.1, 2.0)), float(np.exp(rng.uniform(-3.0, 1.0))), "above"
        ),
    }  # fmt: skip
    scene = Scene("any", stick=stick, effects=effects)
    law = law_of(scene)
    if (
        envelope.judge(law[0], envelope.Limits(1e4, 100.0).record()[0], envelope.new_scratch()).code
        != envelope.OK
    ):
        return None
    return scene, float(bounds.max_roll_speed(law[0], bounds.bounds_of_contact(law[0])))


def test_no_contact_exceeds_what_the_envelope_predicts() -> None:
    """Also where pulses push the flight that gains, and the hand lifts it; the bound is not idle."""
    rng = np.random.default_rng(7)
    nearest, tried = 0.0, 0
    while tried < 300:
        found = _law_and_bound(rng)
        if found is None:
            continue
        scene, most = found
        tried += 1
        below = scene.effects["negative_damping"].below_m_per_s
        for v0 in (0.999 * min(below, most), most):
            contacts = simulate(scene, 1.0, v0, most_contacts=5000).contacts
            if len(contacts):
                fastest = max(np.abs(contacts[:, 1]).max(), contacts[:, 3].max())
                assert fastest <= most * (1.0 + 1e-9)
                nearest = max(nearest, fastest / most if v0 < most else 0.0)
    assert nearest > 0.8


def test_a_set_is_refused_where_the_gain_would_be_too_much() -> None:
    strong = law_of(_scene(-0.02, r=5.0, below=9.0))
    with pytest.raises(envelope.OutOfEnvelope, match=r"lower negative_damping\.r"):
        envelope.require(strong, envelope.Limits(100.0, 10.0))
    envelope.require(law_of(_scene(-0.02, r=5.0, below=0.5)), envelope.Limits(100.0, 10.0))


def test_no_sampled_head_and_no_arm_plays_it() -> None:
    scene = _scene(-0.02)
    late = dataclasses.replace(scene, effects=scene.effects | {"system_delay": SystemDelay(2e-4, 0)})
    arm = envelope.Limits(100.0, 10.0, stiffness_N_per_m=1e4, period_s=1e-3)
    for law, limits in ((law_of(late), envelope.Limits(100.0, 10.0)), (law_of(scene), arm)):
        with pytest.raises(envelope.OutOfEnvelope, match="exact stick alone"):
            envelope.require(law, limits)


def test_what_a_flight_may_still_come_to_is_never_less_than_it_comes_to() -> None:
    """From any point of a flight that gains: what a set that comes now is judged by."""
    rng = np.random.default_rng(3)
    for _ in range(200):
        z_ss = float(rng.choice([-0.03, -0.002, 0.0, 0.003, 0.03]))
        pulse = Pulse(float(rng.choice([0.0, 0.3])), float(np.exp(rng.uniform(-7.0, -2.0))), "exit", 1)
        scene = _scene(z_ss, float(rng.uniform(0.2, 2.0)), 2.0, "unilateral", pulse)
        law, motion = law_of(scene), thrown(scene, float(rng.uniform(0.01, 1.9)))
        motion["pulse"]["acceleration"] = pulse.dv_m_per_s / pulse.tau_s
        exact.advance(law[0], motion[0], float(rng.uniform(0.0, 0.1)))
        if motion["contact_phase"][0] != exact.ABOVE:
            continue
        left = float(motion["pulse"]["acceleration"][0]) * pulse.tau_s
        most = speed_ahead(law[0], motion[0], z_ss, left)
        for _ in range(1000):
            event, _ = exact.advance(law[0], motion[0], 1.0)
            if event == exact.ENTRY:
                break
        assert event == exact.ENTRY
        assert -motion["v_in"][0] <= most * (1.0 + 1e-9)
