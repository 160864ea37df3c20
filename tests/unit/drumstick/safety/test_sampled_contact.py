"""The sampled contact: poles against numpy's roots and closed boundaries, rebounds against closed forms and limits."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drumstick.safety.sampled_contact import (
    MAX_DELAY_TICKS,
    MAX_SLOW_REBOUND,
    MAX_WINDOW,
    SCRATCH_SIZE,
    Arm,
    Head,
    Impact,
    is_stable,
    most_rebound,
    oscillation_speed_per_count,
    rebound,
    slow_rebound,
    slow_rebound_reduction,
    velocity_step_per_count,
    widest_window,
    worst_rebound,
)
from drumstick.stick import contact
from drumstick.stick.contact import PAPER, UNILATERAL

M, T = 0.075, 1e-3


def _arm(m: float = M, delay: int = 0, lead_s: float = 0.0, k_hand: float = 0.0, r_hand: float = 0.0) -> Arm:
    return Arm(m, k_hand, r_hand, T, delay, lead_s)


def _matrix(arm: Arm, head: Head, window: int) -> np.ndarray:
    """One tick as a matrix: position, speed, the last positions and the forces on their way, from plain series."""
    from math import factorial

    a = np.array([[0.0, 1.0], [-arm.k_hand / arm.m, -arm.r_hand / arm.m]]) * arm.period_s
    step = sum(np.linalg.matrix_power(a, n) / factorial(n) for n in range(25))
    push = sum(np.linalg.matrix_power(a, n) / factorial(n + 1) for n in range(25)) @ [
        0.0,
        arm.period_s / arm.m,
    ]
    size = 2 + window + arm.delay_ticks
    damper = (head.r + head.k * arm.lead_s) / (window * arm.period_s)
    force = np.zeros(size)
    force[0] = -(head.k + damper)
    force[1 + window] = damper  # the position `window` ticks ago
    out = np.zeros((size, size))
    out[:2, :2] = step
    acting = force if arm.delay_ticks == 0 else np.eye(size)[size - 1]
    out[:2] += np.outer(push, acting)
    out[2, 0] = 1.0
    for back in range(1, window):
        out[2 + back, 1 + back] = 1.0
    if arm.delay_ticks:
        first = 2 + window
        out[first] = force
        for tick in range(1, arm.delay_ticks):
            out[first + tick, first + tick - 1] = 1.0
    return out


@given(
    k=st.floats(10.0, 3500.0),
    r=st.floats(0.0, 200.0),
    window=st.integers(1, MAX_WINDOW),
    delay=st.integers(0, MAX_DELAY_TICKS),
    lead=st.booleans(),
    k_hand=st.floats(0.0, 2000.0),
    r_hand=st.floats(0.0, 5.0),
)
def test_stable_is_what_the_eigenvalues_of_one_tick_say(
    k: float, r: float, window: int, delay: int, lead: bool, k_hand: float, r_hand: float
) -> None:
    """The polynomial against a matrix that shares no line with it: the state one tick later."""
    arm = _arm(delay=delay, lead_s=(delay + 0.5) * T if lead else 0.0, k_hand=k_hand, r_hand=r_hand)
    head = Head(k, r, UNILATERAL)
    radius = float(np.max(np.abs(np.linalg.eigvals(_matrix(arm, head, window)))))
    assume(abs(radius - 1.0) > 1e-6)
    assert is_stable(arm, head, window, np.zeros(SCRATCH_SIZE)) == (radius < 1.0)


@pytest.mark.parametrize(("delay", "most"), [(0, 2.0), (1, 2.0 * (math.sqrt(2.0) - 1.0))])
def test_a_damper_alone_has_an_upper_end(delay: int, most: float) -> None:
    """R T/m below 2 without delay and below 2 (sqrt 2 - 1) with a tick of it, by Jury's criterion; K goes to 0."""
    for share, stable in ((0.98, True), (1.02, False)):
        head = Head(1e-3, share * most * M / T, UNILATERAL)
        assert is_stable(_arm(delay=delay), head, 1, np.zeros(SCRATCH_SIZE)) == stable


def test_a_spring_needs_more_than_half_a_tick_of_itself() -> None:
    """R above K T/2, to first order in T: below, lag is negative damping."""
    for share, stable in ((0.95, False), (1.05, True)):
        head = Head(100.0, share * 100.0 * T / 2.0, UNILATERAL)
        assert is_stable(_arm(), head, 1, np.zeros(SCRATCH_SIZE)) == stable


@pytest.mark.parametrize("release", [PAPER, UNILATERAL])
@pytest.mark.parametrize("k", [50.0, 200.0])
def test_a_long_contact_gives_back_what_the_closed_form_says(k: float, release: int) -> None:
    """Restitution is as designed in a contact of many ticks, with the lag of T/2 led."""
    arm, r = _arm(lead_s=T / 2.0), 1.0
    found = worst_rebound(arm, Head(k, r, release), 1, np.zeros(SCRATCH_SIZE))
    assert found == pytest.approx(contact.beta(release, M, k, r), rel=0.03)


def test_lag_gives_back_more() -> None:
    found = [
        worst_rebound(_arm(delay=d), Head(1000.0, 2.5, UNILATERAL), 1, np.zeros(SCRATCH_SIZE))
        for d in range(3)
    ]
    assert found == sorted(found)
    assert found[0] < 1.0 < found[2]


def test_an_arm_that_does_not_come_out_gives_nothing_back() -> None:
    assert (
        rebound(_arm(), Head(100.0, 60.0, PAPER), 1, Impact(1.0, 0.5, 0.0, 0.0), np.zeros(SCRATCH_SIZE))
        == 0.0
    )


@given(k=st.floats(50.0, 3500.0), r=st.floats(0.1, 100.0), delay=st.integers(0, 4), m=st.floats(0.02, 0.5))
def test_every_window_up_to_the_widest_keeps_the_promise(k: float, r: float, delay: int, m: float) -> None:
    light, heavy = (
        _arm(0.8 * m, delay, r_hand=0.5, k_hand=60.0),
        _arm(1.25 * m, delay, r_hand=0.5, k_hand=60.0),
    )
    head, scratch = Head(k, r, UNILATERAL), np.zeros(SCRATCH_SIZE)
    widest = widest_window(light, heavy, head, scratch)
    assert 0 <= widest <= MAX_WINDOW
    for window in {1, widest} - {0} if widest else set():
        for arm in (light, heavy):
            assert is_stable(arm, head, window, scratch)
            assert is_stable(arm._replace(k_hand=0.0, r_hand=0.0), head, window, scratch)
            assert worst_rebound(arm, head, window, scratch) < most_rebound(arm, head) < 1.0


def test_one_count_is_what_damper_and_spring_make_of_it() -> None:
    """By hand: (R + K lead) q/(n m), and sqrt(K/m) q."""
    arm, head = _arm(lead_s=0.5e-3), Head(3500.0, 2.0, UNILATERAL)
    assert velocity_step_per_count(arm, head, 5, 3e-5) == pytest.approx((2.0 + 1.75) * 3e-5 / (5 * 0.075))
    assert oscillation_speed_per_count(arm, head, 3e-5) == pytest.approx(math.sqrt(3500.0 / 0.075) * 3e-5)


@pytest.mark.parametrize(
    ("delay", "k", "r", "window"),
    [(2, 800.0, 4.0, 3), (1, 2000.0, 4.0, 1), (0, 3000.0, 4.0, 1), (2, 2000.0, 9.0, 1)],
)
def test_a_slow_blow_is_tried_with_three_masses_at_five_speeds_and_eight_phases_of_tick_and_count(
    delay: int, k: float, r: float, window: int
) -> None:
    light, heavy = _arm(m=0.06, delay=delay), _arm(m=0.09, delay=delay)
    head, scratch = Head(k, r, UNILATERAL), np.zeros(SCRATCH_SIZE)
    found = [
        rebound(
            light._replace(m=0.06 * 1.5**way),
            head,
            window,
            Impact(share * 0.01, phase, 3e-5, offset),
            scratch,
        )
        for way in (0.0, 0.5, 1.0)  # all as it reckons them: another last digit is another count
        for share in (0.97, 1.0, 1.03, 1.06, 1.1)
        for phase in (0.25, 0.75)
        for offset in (0.125, 0.375, 0.625, 0.875)
    ]
    assert min(found) < max(found)
    first = next((each for each in found if each > MAX_SLOW_REBOUND), max(found))
    assert slow_rebound(light, heavy, head, window, 3e-5, scratch) == first


def test_with_fine_counts_a_slow_blow_is_like_any_other() -> None:
    """The law is linear while the arm is in the head, so without counts the speed does not matter."""
    arm, head, scratch = _arm(lead_s=T / 2.0), Head(800.0, 4.0, UNILATERAL), np.zeros(SCRATCH_SIZE)
    for phase in (0.25, 0.75):
        exact = rebound(arm, head, 1, Impact(1.0, phase, 0.0, 0.0), scratch)
        assert rebound(arm, head, 1, Impact(0.01, phase, 0.0, 0.0), scratch) == pytest.approx(exact, rel=1e-9)
        assert rebound(arm, head, 1, Impact(1.0, phase, 1e-7, 0.5), scratch) == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize(
    ("before", "v_before", "z", "v", "reduction"),
    [
        (1e-4, -0.01, -1e-4, -0.01, 0.2),  # it comes in: what its speed says
        (0.0, -0.01, -1e-4, -0.03, 0.1),
        (1e-4, -0.01, -1e-4, -0.04, 0.0),
        (1e-4, -0.01, 0.0, -0.01, 0.15),  # on the surface it is not in yet
        (-1e-4, -0.01, -2e-4, -0.01, 0.15),
        (-2e-4, -0.01, -1e-4, 0.01, 0.15),
        (-2e-4, 0.01, -1e-4, 0.01, 0.15),
        (-1e-4, 0.01, -1e-4, 0.0, 0.15),
        (-1e-4, 0.0, -2e-4, -0.01, 0.15),
        (-1e-4, 0.01, -2e-4, -0.01, 0.0),  # it sinks again
    ],
)
def test_what_a_slow_blow_loses_is_settled_as_it_comes_in_and_forgotten_as_it_sinks_again(
    before: float, v_before: float, z: float, v: float, reduction: float
) -> None:
    assert slow_rebound_reduction(0.15, before, v_before, z, v) == pytest.approx(reduction)


def _played(arm: Arm, head: Head, window: int, blow: Impact) -> float:
    """The same blow in plain lists, each tick by the matrix exponential's series."""
    period, q = arm.period_s, blow.count_m
    step = _matrix(arm._replace(delay_ticks=0), Head(0.0, 0.0, PAPER), 1)[:2, :2]
    pushes = -_matrix(arm._replace(delay_ticks=0, lead_s=0.0), Head(1.0, 0.0, PAPER), 1)[:2, 0] + step[:, 0]

    def told(z: float) -> float:
        return q * math.floor(z / q + blow.offset) if q > 0.0 else z

    z, v = blow.phase * period * blow.speed + q, -blow.speed
    seen = [told(z + ago * period * blow.speed) for ago in range(window, -1, -1)]
    asked, touching, reduction, hunting = [0.0] * (arm.delay_ticks + 1), False, 0.0, 0.0
    above_before, last_speed = 0.0, 0.0
    for tick in range(400):
        speed = (seen[-1] - seen[-1 - window]) / (window * period)
        at = seen[-1] + arm.lead_s * speed
        if q > 0.0:
            reduction = slow_rebound_reduction(reduction, above_before, last_speed, at, speed)
            above_before, last_speed = at, speed if speed != 0.0 else last_speed
        touching = at <= 2.0 * q if touching else at < 0.0
        force = -head.k * at - head.r * speed if touching and at < 0.0 else 0.0
        if head.release == UNILATERAL:
            force = max(force, 0.0)
        asked.append(force * (1.0 - reduction if speed >= 0.0 else 1.0))
        if z > 0.0 and v > 0.0 and not touching and not any(asked[-1 - arm.delay_ticks :]):
            return v / blow.speed
        z, v = (float(each) for each in step @ [z, v] + pushes * asked[-1 - arm.delay_ticks])
        seen.append(told(z))
        if tick > 250:
            hunting = max(hunting, abs(v))
    return hunting / blow.speed if q > 0.0 else 0.0


@pytest.mark.parametrize("release", [PAPER, UNILATERAL])
@pytest.mark.parametrize("count_m", [0.0, 3e-5])
@pytest.mark.parametrize(
    ("arm", "k", "r", "window"),
    [
        (_arm(), 800.0, 4.0, 1),
        (_arm(delay=1, lead_s=T / 2.0), 800.0, 4.0, 3),
        (_arm(delay=3, k_hand=500.0, r_hand=0.5), 400.0, 5.0, 2),
        (_arm(k_hand=2000.0), 800.0, 4.0, 5),
        (_arm(delay=2), 100.0, 60.0, 1),
    ],
)
def test_a_blow_is_what_plain_lists_make_of_it(
    arm: Arm, k: float, r: float, window: int, count_m: float, release: int
) -> None:
    head, scratch = Head(k, r, release), np.zeros(SCRATCH_SIZE)
    for speed in (0.0103, 0.51):
        for phase in (0.17, 0.71):
            blow = Impact(speed, phase, count_m, 0.37)
            assert rebound(arm, head, window, blow, scratch) == pytest.approx(
                _played(arm, head, window, blow), rel=1e-6, abs=1e-9
            )
