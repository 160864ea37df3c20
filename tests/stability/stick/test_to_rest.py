"""A stick that comes to rest: after very many ever smaller bounces, or by creeping up to the very place of z = 0."""

import math

import pytest

import stick_cases
from drumstick.parameters.stick import Stick
from drumstick.stick.methods.carry import STEPPERS
from drumstick.stick.simulate import COLUMNS, Stepper, simulate
from stability.catalogue import shows

# A head that keeps 0.4 % of a blow's speed, and a hand without losses that presses by a tenth of a newton.
BOUNCING = Stick(0.015, 1e6, 0.3065, 20.0, 0.0, -0.005, "paper")
THROWN = 1.0  # m/s


def _bounces(stick: Stick, speed: float) -> list[tuple[float, float]]:
    """The instants s and speeds m/s of all entries until the head keeps it: each contact by itself, by bisection."""
    k = stick.k_coll_N_per_m + stick.k_hand_N_per_m
    a, rest = 0.5 * stick.r_in_N_s_per_m / stick.m_kg, stick.k_hand_N_per_m * stick.z_ss_m / k
    w = math.sqrt(k / stick.m_kg - a * a)
    own = math.sqrt(stick.k_hand_N_per_m / stick.m_kg)
    found, now = list[tuple[float, float]](), 0.0
    while True:
        found.append((now, speed))
        cosine, sine = -rest, (-speed - a * rest) / w

        def height(t: float, cosine: float = cosine, sine: float = sine) -> float:
            return rest + math.exp(-a * t) * (cosine * math.cos(w * t) + sine * math.sin(w * t))

        deepest = (math.atan2(-speed, a * sine + w * cosine) % math.pi) / w
        low, high = deepest, deepest + math.pi / w
        if height(high) < 0.0:
            return found
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if height(middle) < 0.0 else (low, middle)
        turning = -speed * math.cos(w * low) - (a * sine + w * cosine) * math.sin(w * low)
        speed = math.exp(-a * low) * turning
        # Undamped above the head: it comes back as fast as it left.
        now += low + 2.0 / own * math.atan2(speed, -own * stick.z_ss_m)


@shows("bounces without number")
def test_sixteen_hundred_bounces_end_in_the_head_and_fixed_steps_play_on_for_ever() -> None:
    expected = _bounces(BOUNCING, THROWN)
    assert 1590 < len(expected) < 1610
    scene = stick_cases.scene(BOUNCING)
    for method in STEPPERS:
        naive = simulate(scene, 60.0, -THROWN, Stepper(method, 1e-4, locates=False))
        assert naive.end == "time"  # half as long again as it takes
    ours = simulate(scene, 60.0, -THROWN)
    assert ours.end == "captured"
    # The last entry is the one that the head keeps: it has no exit.
    assert len(ours.contacts) == len(expected) - 1
    for row, (t, speed) in zip(ours.contacts, expected, strict=False):
        assert row[COLUMNS.index("t_in_s")] == pytest.approx(t, abs=1e-10)
        assert -row[COLUMNS.index("v_in_m_per_s")] == pytest.approx(speed, rel=1e-9)
    assert ours.t_end_s == pytest.approx(expected[-1][0], abs=2e-3)  # it is known once the head turns it


@shows("balanced stick")
@pytest.mark.parametrize("method", STEPPERS)
def test_a_stick_that_creeps_up_to_the_surface_rests_there_and_by_steps_strikes_for_ever(method: str) -> None:
    """Its numbers become too small to tell a sign: a crossing then is no strike, and fires no pulse."""
    scene = stick_cases.scene(*stick_cases.BALANCED)
    ours = simulate(scene, 600.0, -0.07)
    assert (ours.end, len(ours.contacts)) == ("captured", 2)
    naive = simulate(scene, 60.0, -0.07, Stepper(method, 1e-4, locates=False))
    assert (naive.end, len(naive.contacts) > 40) == ("time", True)
