"""alpha, beta, capture speed and kappa: one flight or one contact, against the reference and against closed forms."""

import dataclasses
import math

import mpmath
import numpy as np
import pytest

import stick_cases
from drumstick.analysis.flight import flight
from drumstick.analysis.gain import gain, overdamped
from drumstick.analysis.predictions import kappa_of, restitution_eq3
from drumstick.analysis.rebound import capture_speed, rebound
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.hysteretic_spring import HystereticSpring
from drumstick.stick.effects.negative_damping import NegativeDamping
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.motion import exact

M, K_COLL = 0.015, 5000.0
W0 = math.sqrt(K_COLL / M)
A = stick_cases.STICK_A
BETA = stick_cases.rows("beta.csv")
MAP = stick_cases.rows("contact_map.csv")
ALPHA = stick_cases.rows("alpha.csv")
SETS = {row["set"]: row for row in stick_cases.rows("limit_cycles.csv")}


def _free(zeta: float, release: str) -> Stick:
    r_in = 2.0 * zeta * math.sqrt(M * K_COLL)
    return Stick(M, K_COLL, r_in, 0.0, 0.0, 0.0, release)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("name", sorted({row["set"] for row in ALPHA}))
def test_soft_collision(name: str) -> None:
    numbers = [float(SETS[name][key]) for key in ("m", "K_coll", "R_in", "K_hand", "R_out", "z_ss")]
    # The pulse of the scene has no part in a flight's alpha.
    played = stick_cases.scene(Stick(*numbers), Pulse(0.5, 0.02, "exit", 1))
    flights = [row for row in ALPHA if row["set"] == name]
    found = [flight(played, float(row["v_out"])) for row in flights]
    expected = [[float(row[key]) for key in ("alpha", "t_flight", "z_apex")] for row in flights]
    np.testing.assert_allclose(np.array(found), expected, rtol=1e-9)


def test_a_flight_without_return_has_no_alpha() -> None:
    held = stick_cases.scene(Stick(0.015, 5000.0, 1.3, 20.0, 0.1, 0.05, "paper"))
    assert flight(held, 1.0) is None
    assert flight(stick_cases.scene(_free(0.1, "paper")), 1.0) is None
    assert flight(stick_cases.scene(A), 0.0) is None
    assert flight(stick_cases.scene(A), -1.0) is None


# One that is thrown back, and the critically damped one: all of the table is in test_one_contact.py.
TOLD = [row for row in BETA if row["release"] == "force" and float(row["zeta"]) in (0.2, 1.0)]


@pytest.mark.parametrize("row", TOLD, ids=lambda row: f"zeta {row['zeta']}")
def test_restitution(row: dict[str, str]) -> None:
    numbers = [float(row[key]) for key in ("m", "K_coll", "R_in", "K_hand")]
    stick = Stick(*numbers, 0.0, float(row["z_ss"]), stick_cases.RELEASE[row["release"]])  # pyright: ignore
    # The pulse of the scene has no part in beta.
    found = rebound(stick_cases.scene(stick, Pulse(0.5, 0.02, "entry", 1)), -float(row["v_in"]))
    if row["beta_meas"].startswith("never leaves"):
        assert found is None
    else:
        assert found is not None
        assert found.beta == pytest.approx(float(row["beta_meas"]), rel=1e-9)
        assert found.z_min_m == pytest.approx(float(row["z_min"]), rel=1e-9)
    if float(row["zeta"]) >= 1.0:
        assert overdamped(stick)
        assert restitution_eq3(stick) is None
    else:
        assert restitution_eq3(stick) == pytest.approx(float(row["beta_eq3"]), rel=1e-11)


def _capture_closed_form(stick: Stick) -> float:
    # Backwards in time from the grazing end, z = 0 at rest, to the entry before it; release at z = 0, 40 digits.
    with mpmath.workdps(40):
        stiffness = mpmath.mpf(stick.k_hand_N_per_m) + stick.k_coll_N_per_m
        w = mpmath.sqrt(stiffness / stick.m_kg)
        zeta = mpmath.mpf(stick.r_in_N_s_per_m) / (2 * stick.m_kg) / w
        depth = -mpmath.mpf(stick.k_hand_N_per_m) * stick.z_ss_m / stiffness
        omega = mpmath.sqrt(1 - zeta**2)

        def above(s: mpmath.mpf) -> mpmath.mpf:
            return mpmath.exp(zeta * s) * (mpmath.cos(omega * s) - zeta / omega * mpmath.sin(omega * s)) - 1

        low, high = mpmath.pi / omega, 2 * mpmath.pi / omega
        for _ in range(140):
            middle = (low + high) / 2
            low, high = (middle, high) if above(middle) < 0 else (low, middle)
        return float(-depth * w * mpmath.exp(zeta * low) * mpmath.sin(omega * low) / omega)


@pytest.mark.parametrize(
    "stick",
    [
        A,
        Stick(0.015, 5000.0, 1.3, 8.0, 0.05, -0.03, "paper"),
        Stick(0.075, 3500.0, 2.5, 60.0, 0.5, -0.03, "paper"),
        Stick(0.015, 5000.0, 0.05, 20.0, 0.0, -0.02, "paper"),
        Stick(0.015, 5000.0, 12.0, 2000.0, 5.0, -0.001, "paper"),
        Stick(0.015, 5000.0, 16.5, 20.0, 0.1, -0.02, "paper"),
    ],
    ids=lambda stick: f"K_hand {stick.k_hand_N_per_m:g} R_in {stick.r_in_N_s_per_m:g}",
)
def test_capture_speed_by_tracing_the_grazing_contact_back(stick: Stick) -> None:
    assert capture_speed(stick_cases.scene(stick)) == pytest.approx(_capture_closed_form(stick), rel=1e-12)


def test_capture_speed_divides_contacts_that_end_from_those_that_do_not() -> None:
    held = Stick(0.015, 5000.0, 3.0, 20.0, 0.4, -0.02, "unilateral")
    for played in (stick_cases.scene(held), stick_cases.scene(held, Pulse(1.0, 0.002, "exit", 1))):
        threshold = capture_speed(played)
        assert threshold is not None
        bare = stick_cases.scene(held)
        assert stick_cases.until(bare, -threshold * (1.0 + 1e-12), exact.RELEASE) is not None
        assert stick_cases.until(bare, -threshold * (1.0 - 1e-12), exact.RELEASE) is None


@pytest.mark.parametrize(
    "stick",
    [
        Stick(0.015, 5000.0, 1.3, 20.0, 0.1, 0.0, "paper"),  # nothing presses
        Stick(0.015, 5000.0, 1.3, 20.0, 0.1, 0.01, "unilateral"),
        Stick(0.015, 5000.0, 1.3, 0.0, 0.1, -0.02, "paper"),
        Stick(0.015, 5000.0, 40.0, 20.0, 0.1, -0.02, "paper"),  # overdamped: nothing ever leaves
        Stick(0.015, 5000.0, 0.0, 20.0, 0.0, -0.02, "paper"),  # lossless: everything leaves
    ],
)
def test_no_capture_speed(stick: Stick) -> None:
    assert capture_speed(stick_cases.scene(stick)) is None


@pytest.mark.parametrize("z_ss", [-5e-324, -1e-310, -1e-303])
def test_a_hand_that_presses_by_less_than_a_normal_number_captures_nothing(z_ss: float) -> None:
    """The scan of speeds once began at 0 there, and never ended."""
    assert capture_speed(stick_cases.scene(dataclasses.replace(A, z_ss_m=z_ss))) is None


def test_a_head_that_gives_energy_to_slow_blows_captures_the_fastest_of_those_that_stay() -> None:
    """Below 0.03 m/s the damping is negative and nothing stays; from there to the ordinary threshold all do."""
    ordinary = capture_speed(stick_cases.scene(A))
    altered = Scene("altered", stick=A, effects={"negative_damping": NegativeDamping(2.5, 0.03)})
    assert ordinary is not None
    assert capture_speed(altered) == pytest.approx(ordinary, rel=1e-12)
    assert rebound(altered, 0.029) is not None
    assert rebound(altered, 0.031) is None
    assert capture_speed(Scene("x", stick=A, effects={"negative_damping": NegativeDamping(2.5, 1.0)})) is None


@pytest.mark.parametrize("row", MAP, ids=lambda row: f"zeta {row['zeta']} tau {row['tau_over_tc']}")
def test_kappa_at_entry(row: dict[str, str]) -> None:
    """The reference's small-dv gain of a pulse up at entry."""
    stick = _free(float(row["zeta"]), "paper")
    t_c = math.pi / (W0 * math.sqrt(1.0 - float(row["zeta"]) ** 2))
    found = gain(stick, "entry", 1, float(row["tau_over_tc"]) * t_c)
    assert found == pytest.approx(float(row["small_dv_gain_closed_form(sign +1)"]), abs=1e-9)


@pytest.mark.parametrize("release", ["paper", "unilateral"])
@pytest.mark.parametrize("trigger", ["entry", "turn", "exit"])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("tau_s", [1e-4, 2e-3, 0.05])
def test_kappa_is_the_derivative_of_the_exact_contact(
    release: str, trigger: str, sign: int, tau_s: float
) -> None:
    """v_E of exact contacts over dv, by central differences; zeta 0.4, where both releases differ by much."""
    stick = _free(0.4, release)

    def v_e(dv: float) -> float:
        # A pulse of -dv is one of dv the other way.
        pulse = Pulse(abs(dv), tau_s, trigger, sign if dv > 0.0 else -sign)  # pyright: ignore
        found = stick_cases.until(stick_cases.scene(stick, pulse), -1.0, exact.RELEASE)
        assert found is not None
        return float(found[0]["v_out"][0] + tau_s * found[0]["pulse"]["acceleration"][0])

    slopes = [(v_e(dv) - v_e(-dv)) / (2.0 * dv) for dv in (2e-3, 1e-3)]
    extrapolated = (4.0 * slopes[1] - slopes[0]) / 3.0
    assert gain(stick, trigger, sign, tau_s) == pytest.approx(extrapolated, abs=1e-8)


def test_kappa_where_a_head_that_only_pushes_is_overdamped() -> None:
    stick = _free(1.5, "unilateral")
    pulse = Pulse(1e-4, 1e-3, "entry", 1)
    with_pulse = stick_cases.until(stick_cases.scene(stick, pulse), -1.0, exact.RELEASE)
    without = stick_cases.until(stick_cases.scene(stick), -1.0, exact.RELEASE)
    assert with_pulse is not None
    assert without is not None
    v_e = float(with_pulse[0]["v_out"][0] + 1e-3 * with_pulse[0]["pulse"]["acceleration"][0])
    assert gain(stick, "entry", 1, 1e-3) == pytest.approx(
        (v_e - float(without[0]["v_out"][0])) / 1e-4, abs=1e-3
    )


def test_kappa_does_not_exist() -> None:
    pulse = Pulse()
    assert kappa_of(stick_cases.scene(_free(1.5, "paper"), pulse)) is None
    assert kappa_of(stick_cases.scene(A)) is None
    altered = Scene("altered", stick=A, effects={"pulse": pulse, "hysteretic_spring": HystereticSpring(1.2)})
    assert kappa_of(altered) is None
    assert kappa_of(stick_cases.scene(A, pulse)) == 1.0
