"""The bounds are tight: each against a number from a closed form that shares no line with it."""

import math
from collections.abc import Callable
from typing import Any

import pytest
from scipy.optimize import brentq

from drumstick.safety import bounds, contact_bounds
from drumstick.scenes.scene_text import parse
from drumstick.stick.contact import PAPER, UNILATERAL
from drumstick.stick.law import Records, law_of

M, K = 0.02, 800.0  # sqrt(m K) = 4 N s/m, and half a turn takes 15.7 ms
SPRING = math.sqrt(M * K)
EXACTLY: dict[str, Any] = {"rel": 1e-9}
FOUND: dict[str, Any] = {"rel": 2e-6}  # what is found by bisection


def _law(effects: str = "", **values: float) -> Records:
    law = law_of(parse(effects, "by hand"))
    given = {"m": M, "k_coll": K, "r_in": 0.0, "r_out": 0.0, "k_hand": 0.0, "z_ss": 0.0, "release": PAPER}
    for name, value in (given | values).items():
        law[name] = value
    return law


def _hysteretic(ratio: float) -> str:
    return f"[effects.hysteretic_spring]\nratio = {ratio}\n"


def _pulse(dv: float, tau: float, overlap: str = "ignore") -> str:
    return f'[effects.pulse]\ndv_m_per_s = {dv}\ntau_s = {tau}\noverlap = "{overlap}"\n'


def _of(law: Records) -> contact_bounds.ContactBound:
    return contact_bounds.bound_contact(law[0], float(law["r_in"][0]))


def test_a_lifting_hand_gives_the_speed_of_its_swing_and_a_pressing_one_that_of_its_rest_in_the_head() -> (
    None
):
    """sqrt(5/0.02) is 15.8 1/s; pressed 0.1 m deep by 0.5 N: 0.5 N/sqrt(0.02 kg 805 N/m)."""
    assert bounds.hand_speed(_law(k_hand=5.0, z_ss=0.1)[0]) == pytest.approx(
        0.1 * math.sqrt(250.0), **EXACTLY
    )
    pressing = 0.5 / math.sqrt(0.02 * 805.0)
    assert bounds.hand_speed(_law(k_hand=5.0, z_ss=-0.1)[0]) == pytest.approx(pressing, **EXACTLY)
    assert bounds.pressing_speed(_law(k_hand=5.0, z_ss=0.1)[0]) == 0.0


@pytest.mark.parametrize("zeta", [0.0, 0.1, 0.3])
def test_a_paper_head_in_no_hand_leaves_equation_3(zeta: float) -> None:
    found = _of(_law(r_in=2.0 * zeta * SPRING))
    assert found.restitution == pytest.approx(math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2)), **EXACTLY)
    assert found.added_speed == found.static_force == 0.0


def test_negative_damping_grows_by_what_half_a_turn_makes_of_it() -> None:
    """zeta -1/2: exp(pi/sqrt 3) = 6.13, the most that the effect's own page names."""
    found = contact_bounds.bound_contact(_law()[0], -SPRING)
    assert found.restitution == pytest.approx(math.exp(math.pi / math.sqrt(3.0)), **EXACTLY)
    assert found.force_per_speed == pytest.approx(SPRING * math.sqrt(2.0) * found.restitution**2, **EXACTLY)


def test_the_hand_stiffens_a_head_which_loses_less() -> None:
    """R 0.8 N s/m on 800 + 50 N/m."""
    zeta = 0.8 / (2.0 * math.sqrt(0.02 * 850.0))
    assert _of(_law(r_in=0.8, k_hand=50.0)).restitution == pytest.approx(
        math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2)), **EXACTLY
    )


def test_a_head_that_lets_go_early_leaves_a_hand_the_rest_of_the_way() -> None:
    """It lets go at z = -v (R_in - R_out)/K, and from there 50 N/m on 0.02 kg add to v^2 at most 2500 z^2."""
    zeta = 2.0 / (2.0 * math.sqrt(0.02 * 850.0))
    own = math.exp(-2.0 * zeta * math.acos(zeta) / math.sqrt(1.0 - zeta**2))
    found = _of(_law(r_in=2.0, r_out=0.4, k_hand=50.0, release=UNILATERAL)).restitution
    assert found == pytest.approx(own * math.sqrt(1.0 + 2500.0 * (1.6 / 800.0) ** 2), **EXACTLY)


@pytest.mark.parametrize("ratio", [1.0, 2.25, 4.0])
def test_a_stiffer_way_out_gives_back_the_root_of_its_ratio_and_throws_what_was_pressed_in(
    ratio: float,
) -> None:
    """The energy of a stick that sank in twice as deep as it rests, d: (ratio - 1) K (2 d)^2/2, d = speed/w."""
    law = _law(_hysteretic(ratio), k_hand=5.0, z_ss=-0.1)
    found, speed = _of(law), bounds.pressing_speed(law[0])
    assert found.restitution == pytest.approx(math.sqrt(ratio), **EXACTLY)
    assert found.added_speed == pytest.approx(2.0 * speed * math.sqrt(ratio - 1.0), **EXACTLY)
    assert found.force_per_speed == pytest.approx(SPRING * ratio, **EXACTLY)
    assert found.static_force == pytest.approx(2.0 * 0.5 * ratio, **EXACTLY)


def test_a_stick_that_lies_on_a_head_that_gives_energy_grows_for_two_half_turns() -> None:
    """Both: its amplitude, the rest's depth, grows by g^2 before it is out, and what it rests at is still there."""
    law = _law(k_hand=5.0, z_ss=-0.1)
    zeta = 0.1
    g = math.exp(math.pi * zeta / math.sqrt(1.0 - zeta**2))
    found = contact_bounds.bound_contact(law[0], -2.0 * zeta * SPRING)
    assert found.restitution == pytest.approx(g, **EXACTLY)
    assert found.added_speed == pytest.approx(
        bounds.pressing_speed(law[0]) * math.sqrt(g**4 - 1.0), **EXACTLY
    )
    assert found.static_force == pytest.approx(2.0 * 0.5 * g * g, **EXACTLY)


@pytest.mark.parametrize(("zeta", "times"), [(0.5, 1.0), (0.8, 1.6), (1.5, 3.0)])
def test_a_head_that_damps_much_hits_hardest_at_entry(zeta: float, times: float) -> None:
    """R v, with R = 2 zeta sqrt(m K)."""
    assert _of(_law(r_in=2.0 * zeta * SPRING)).force_per_speed == pytest.approx(times * SPRING, **EXACTLY)


def test_a_head_less_damped_than_the_hand_is_bounded_by_both_at_once() -> None:
    found = contact_bounds.bound_contact(_law(r_out=3.0)[0], 0.0)
    assert found.force_per_speed == pytest.approx(math.hypot(SPRING, 3.0), **EXACTLY)


def test_an_undamped_blow_meets_the_root_of_m_k() -> None:
    """3 m/s on sqrt(m K) = 4 N s/m: 12 N; with a hand that presses by 0.5 N twice that on top."""
    free, pressed = _law(), _law(k_hand=5.0, z_ss=-0.1)
    assert bounds.max_contact_force(free[0], bounds.bounds_of_contact(free[0]), 3.0) == pytest.approx(
        12.0, **EXACTLY
    )
    assert bounds.max_contact_force(pressed[0], bounds.bounds_of_contact(pressed[0]), 3.0) == pytest.approx(
        13.0, **EXACTLY
    )


@pytest.mark.parametrize(("below", "speed", "slow_at"), [(0.4, 0.2, 0.2), (0.4, 0.5, 0.4), (1.5, 2.0, 1.5)])
def test_a_slow_contact_counts_where_it_meets_more_than_the_fastest(
    below: float, speed: float, slow_at: float
) -> None:
    """zeta -1/2 in it: 4 N s/m times sqrt 2 times exp(2 pi/sqrt 3)."""
    law = _law(f"[effects.negative_damping]\nr_N_s_per_m = {SPRING}\nbelow_m_per_s = {below}\n")
    most = slow_at * SPRING * math.sqrt(2.0) * math.exp(2.0 * math.pi / math.sqrt(3.0))
    assert bounds.max_contact_force(law[0], bounds.bounds_of_contact(law[0]), speed) == pytest.approx(
        most, **EXACTLY
    )


@pytest.mark.parametrize(("tau", "blow_like"), [(1e-3, True), (0.5, False)])
def test_a_pulse_in_a_slow_contact_is_answered_as_that_answers(tau: float, blow_like: bool) -> None:
    """Damping ratio -1/2 in it: 4 N s/m times sqrt 2 times exp(2 pi/sqrt 3); half a turn grows by exp(pi/sqrt 3)."""
    law = _law(
        f"[effects.negative_damping]\nr_N_s_per_m = {SPRING}\nbelow_m_per_s = 0.4\n" + _pulse(0.3, tau)
    )
    grown = math.exp(2.0 * math.pi / math.sqrt(3.0))
    own, meets = 0.02 * 0.3 / tau, SPRING * math.sqrt(2.0) * grown
    answer = meets * 0.3 if blow_like else 2.0 * own * grown
    found = bounds.max_contact_force(law[0], bounds.bounds_of_contact(law[0]), 0.4)
    assert found == pytest.approx(meets * 0.4 + own + answer, **EXACTLY)


@pytest.mark.parametrize("ratio", [1.0, 4.0])
@pytest.mark.parametrize(("tau", "blow_like"), [(1e-3, True), (0.5, False)])
def test_a_pulse_is_answered_like_a_blow_of_its_speed_or_like_a_steady_force(
    tau: float, blow_like: bool, ratio: float
) -> None:
    """m dv/tau, and on top the head's answer: peak dv, or twice a steady force, grown by the contact twice."""
    law = _law(_hysteretic(ratio) + _pulse(0.3, tau))
    own, blows = 0.02 * 0.3 / tau, bounds.bounds_of_contact(law[0])
    answer = SPRING * ratio * 0.3 if blow_like else 2.0 * own * ratio
    found = bounds.max_contact_force(law[0], blows, 1.0)
    assert found == pytest.approx(SPRING * ratio + own + answer, **EXACTLY)


def test_pulses_that_stack_come_half_a_sinking_apart_at_the_soonest() -> None:
    """A quarter of the period of 800 N/m and 0.02 kg, 7.85 ms: the sum of a geometric series."""
    tau = 0.5
    law = _law(_pulse(0.3, tau, "add"))
    stacked = 0.02 * 0.3 / tau / (1.0 - math.exp(-0.5 * math.pi * math.sqrt(0.02 / 800.0) / tau))
    found = bounds.max_contact_force(law[0], bounds.bounds_of_contact(law[0]), 1.0)
    assert found == pytest.approx(SPRING + stacked + min(SPRING * 0.3, 2.0 * stacked), **EXACTLY)


def _settled(after: Callable[[float], float]) -> float:
    return float(brentq(lambda u: after(u) - u, 1e-5, 99.0, xtol=1e-14, rtol=1e-14))


def _back(law: Records, v: float) -> float:
    # A flight under a spring that rests at -d, with its damping: the later root of z(t) by brentq.
    m, k, r, d = (float(law[name][0]) for name in ("m", "k_hand", "r_out", "z_ss"))
    a = 0.5 * r / m
    w = math.sqrt(k / m - a * a)

    def z(t: float) -> float:
        return math.exp(-a * t) * (-d * math.cos(w * t) + (v - a * d) / w * math.sin(w * t)) + d

    t = float(brentq(z, 1e-6, math.pi / w, xtol=1e-16, rtol=1e-14))
    step = 1e-6
    return abs(z(t + step) - z(t - step)) / (2.0 * step)


def test_a_lively_head_under_a_pressing_hand_settles_where_the_flight_takes_what_it_gives() -> None:
    """A short pulse: A grows by e and what pressing adds, and by the pulse over its share of the flight's loss."""
    tau, dv, ratio = 1e-3, 0.2, 1.44
    law = _law(_hysteretic(ratio) + _pulse(dv, tau), k_hand=5.0, z_ss=-0.1, r_out=0.12, r_in=0.12)
    own, hand = _of(law), bounds.pressing_speed(law[0])
    e = own.restitution
    assert e > 1.0
    kept = math.hypot(own.added_speed, hand) - e * hand

    def after(u: float) -> float:
        before = e * math.hypot(u, hand) + kept
        late = e * dv + _back(law, math.sqrt(before**2 - hand**2))
        grown = before + e * dv / (1.0 - 0.12 / 0.02 * tau)
        return min(late, _back(law, math.sqrt(grown**2 - hand**2)))

    most = _settled(after)
    found = bounds.max_roll_speed(law[0], bounds.bounds_of_contact(law[0]))
    assert found == pytest.approx(e * most + own.added_speed + e * dv, rel=1e-5)


def test_a_pulse_longer_than_the_damping_lasts_comes_on_top_of_the_flight() -> None:
    """R_out tau/m above 1: nothing is taken from it."""
    dv, ratio = 0.2, 1.44
    law = _law(_hysteretic(ratio) + _pulse(dv, 0.2), k_hand=5.0, z_ss=-0.1, r_out=0.12, r_in=0.12)
    own, hand = _of(law), bounds.pressing_speed(law[0])
    e = own.restitution
    kept = math.hypot(own.added_speed, hand) - e * hand

    def after(u: float) -> float:
        before = e * math.hypot(u, hand) + kept
        return e * dv + _back(law, math.sqrt(before**2 - hand**2))

    found = bounds.max_roll_speed(law[0], bounds.bounds_of_contact(law[0]))
    assert found == pytest.approx(e * _settled(after) + own.added_speed + e * dv, rel=1e-5)


@pytest.mark.parametrize("ratio", [1.0, 1.44])
def test_a_hand_that_lifts_gives_back_half_a_swing(ratio: float) -> None:
    """A pulse of 0.2 m/s comes on top of exp(-pi a/w) of the amplitude, of which the hand's own speed is no part."""
    dv, z_ss = 2.0, 0.01
    law = _law(_hysteretic(ratio) + _pulse(dv, 1e-3), k_hand=5.0, z_ss=z_ss, r_out=0.12, r_in=0.12)
    own, hand = _of(law), math.sqrt(5.0 / 0.02) * z_ss
    a = 0.5 * 0.12 / 0.02
    left = math.exp(-math.pi * a / math.sqrt(5.0 / 0.02 - a * a))
    kept, grown = max(own.restitution, math.sqrt(ratio)), max(own.restitution, 1.0)

    def after(u: float) -> float:
        return math.sqrt((left * math.hypot(kept * u, hand) + grown * dv) ** 2 - hand**2)

    most = _settled(after)
    leaving = max(most, own.restitution * most + own.added_speed + grown * dv)
    assert bounds.max_roll_speed(law[0], bounds.bounds_of_contact(law[0])) == pytest.approx(leaving, **FOUND)


def test_a_flight_that_gains_above_a_lifting_hand_swings_twice_about_its_rest() -> None:
    """r = -0.3 N s/m, 10 mm above the head: an amplitude of hypot(v, w d) at the start grows for a whole swing, and the
    speed at the head is what is left of it beside w d."""
    m, k, r, d, v = M, 20.0, -0.3, 0.01, 0.2
    text = f'[effects.negative_damping]\nr_N_s_per_m = {-r}\nbelow_m_per_s = {v}\nwhere = "above"\n'
    law = _law(text, r_in=2.0, k_hand=k, z_ss=d)
    about = math.sqrt(k / m) * d
    most = math.hypot(v, about) * math.exp(-2.0 * math.pi * r / math.sqrt(4.0 * m * k - r * r))
    found = bounds.max_roll_speed(law[0], bounds.bounds_of_contact(law[0]))
    assert found == pytest.approx(math.sqrt(most**2 - about**2), **EXACTLY)


def test_while_a_contact_loses_speed_the_roll_is_a_geometric_series() -> None:
    """Equation (7) without loss in flight: (dv + what pressing adds)/(1 - e)."""
    law = _law(_pulse(0.2, 1e-3), r_in=0.8, k_hand=5.0, z_ss=-0.1)
    own, hand = _of(law), bounds.pressing_speed(law[0])
    kept = hand - own.restitution * hand
    found = bounds.max_roll_speed(law[0], bounds.bounds_of_contact(law[0]))
    assert found == pytest.approx((0.2 + kept) / (1.0 - own.restitution), **EXACTLY)


def test_a_head_that_loses_nothing_in_no_hand_is_endless() -> None:
    law = _law(_pulse(0.2, 1e-3))
    assert bounds.max_roll_speed(law[0], bounds.bounds_of_contact(law[0])) == bounds.UNBOUNDED_M_PER_S


@pytest.mark.parametrize(
    ("max_speed", "max_force", "most"),
    [(5.0, 1000.0, 5.0 - 0.3), (1000.0, 18.0, 4.5), (5.0, 18.0, 4.5), (4.0, 18.0, 4.0 - 0.3)],
)
def test_the_fastest_entry_stays_below_both_limits(max_speed: float, max_force: float, most: float) -> None:
    """Undamped, it leaves 0.3 m/s faster; and 4 N s/m times the speed is the force. Each limit alone, then both."""
    law = _law(_pulse(0.3, 0.9))
    law["pulse"]["tau"] = 1e9  # a push that goes on for ever has no force
    found = bounds.max_entry_speed(law[0], bounds.bounds_of_contact(law[0]), 0.1, max_speed, max_force)
    assert found == pytest.approx(most, abs=2e-6 * max_speed)


def test_an_entry_that_fits_is_never_made_less() -> None:
    law = _law()
    assert bounds.max_entry_speed(law[0], bounds.bounds_of_contact(law[0]), 7.0, 5.0, 1.0) == 7.0


def test_a_throw_counts_when_it_is_faster_than_the_roll() -> None:
    law = _law(r_in=0.8)
    blows = bounds.bounds_of_contact(law[0])
    for throw, most in ((0.0, 2.0), (1.5, 2.0), (3.0, 3.0)):
        assert bounds.max_speed_after_throw(law[0], blows, 2.0, throw) == most
