"""A hand whose grip moves while it plays: beside a solver, beside ever shorter ticks, and beside `analyse`."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy import integrate

import drumstick as ds
from drumstick.analysis.cycles.grips import grips_at, grips_of
from drumstick.scenes.gesture import gesture_of, stick_gesture
from drumstick.scenes.recording import Recording
from drumstick.stick import moving_hand
from drumstick.stick.effects.negative_damping import NegativeDamping

GRIP = ds.scene("grip")
PERIOD_S = 9.4
_integrate: Any = integrate  # scipy publishes no types
T_IN, V_IN, PEAK = 0, 1, 5


def _gesture(scene: ds.Scene = GRIP) -> Recording:
    found = stick_gesture(scene, None)
    assert found is not None
    return found


def _rates(contacts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    # Of each flight: the time amid it, s, and its rate, Hz.
    return 0.5 * (contacts[1:, T_IN] + contacts[:-1, T_IN]), 1.0 / np.diff(contacts[:, T_IN])


def _predicted(times_s: np.ndarray) -> np.ndarray:
    return np.array([grip.rate_Hz for grip in grips_at(GRIP, _gesture(), times_s)])


def test_the_grip_alone_takes_the_roll_to_30_hz_and_back_as_analyse_predicts_for_each_grip() -> None:
    """While a ramp of seconds goes on, every flight is within 1.5 % of the roll that its grip would settle in."""
    assert set(GRIP.effects) == {"pulse"}
    times, rates = _rates(moving_hand.play(GRIP, _gesture(), PERIOD_S, 0.4).contacts)
    slow = (times > 0.6) & (times < 7.4)
    assert np.abs(rates[slow] / _predicted(times[slow]) - 1.0).max() < 0.015
    held = (times > 4.2) & (times < 4.5)
    assert rates[held] == pytest.approx(30.05, abs=0.1)
    settled = (times > 7.0) & (times < 7.4)
    assert rates[settled] == pytest.approx(9.57, abs=0.05)


def test_a_squeeze_as_quick_as_a_hand_is_followed_within_ten_strikes() -> None:
    """Within the 100 ms no flight is off by more than a fifth; half a second later it is what `analyse` predicts."""
    rows = _gesture()
    assert np.diff(rows[:, 0]).min() >= 0.1 - 1e-9
    times, rates = _rates(moving_hand.play(GRIP, _gesture(), PERIOD_S, 0.4).contacts)
    off = rates / _predicted(times) - 1.0
    assert 0.05 < np.abs(off[(times > 7.5) & (times < 7.7)]).max() < 0.2
    assert np.abs(off[(times > 7.85) & (times < 8.28)]).max() < 0.02


def test_a_grip_that_stands_still_in_each_tick_errs_by_the_square_of_the_tick() -> None:
    """1 ms, as live: 4 us in the time of a contact, 7e-5 of speed and peak; half the tick, a quarter of that."""
    converged = moving_hand.play(GRIP, _gesture(), PERIOD_S, 0.4, tick_s=1.0 / 64_000.0).contacts

    def errors(tick_s: float) -> np.ndarray:
        found = moving_hand.play(GRIP, _gesture(), PERIOD_S, 0.4, tick_s=tick_s).contacts
        assert len(found) == len(converged)
        late = np.abs(found[:, T_IN] - converged[:, T_IN]).max()
        return np.array([late, *(np.abs(found[:, c] / converged[:, c] - 1.0).max() for c in (V_IN, PEAK))])

    live, half = errors(1e-3), errors(0.5e-3)
    assert np.all(live < [5e-6, 1e-4, 1e-4])
    assert np.all(half < 0.35 * live)


def test_the_flight_of_a_changing_grip_is_that_of_a_solver() -> None:
    """m z'' + R(t) z' + K(t) (z - z_ss) = 0 from a throw until the stick is back, K, R and z_ss all on the move."""
    scene = dataclasses.replace(GRIP, servo=dataclasses.replace(GRIP.servo, rate_Hz=4000))
    text = "t_s,z_m,k_hand_N_per_m,r_out_N_s_per_m\n0,-0.01,27,0.1\n0.03,-0.02,8,0.3\n0.5,-0.02,8,0.3\n"
    run = ds.simulate(scene, 0.2, 0.5, gesture=text)
    stick = scene.stick

    def rates(t: float, state: np.ndarray) -> list[float]:
        k, r, z = (
            float(np.interp(t, (0.0, 0.03), ends)) for ends in ((27.0, 8.0), (0.1, 0.3), (-0.01, -0.02))
        )
        return [state[1], (-r * state[1] - k * (state[0] - z)) / stick.m_kg]

    def meets_head(t: float, state: np.ndarray) -> float:
        return float(state[0]) if t > 0.0 else 1.0

    solved = _integrate.solve_ivp(
        rates, (0.0, 0.2), [0.0, 0.5], "DOP853", events=meets_head, rtol=1e-11, atol=1e-13, dense_output=True
    )
    assert run.contacts["t_in_s"][0] == pytest.approx(float(solved.t_events[0][0]), rel=1e-5)
    assert run.contacts["v_in_m_per_s"][0] == pytest.approx(float(solved.y_events[0][0][1]), rel=1e-5)
    times = np.linspace(0.0, 0.02, 9)
    at = run.motion(times).z_m
    np.testing.assert_allclose(at, [solved.sol(t)[0] for t in times], atol=1e-7)


def test_a_file_that_moves_nothing_plays_the_roll_itself() -> None:
    """Rows that say what [stick] says: only rounding at the ends of ticks may differ."""
    roll = ds.scene("roll")
    scene = dataclasses.replace(roll, hand=dataclasses.replace(GRIP.hand, gesture_file="still.csv"))
    text = "t_s,z_m,k_hand_N_per_m,r_out_N_s_per_m\n0,-0.02,20,0.1\n0.7,-0.02,20,0.1\n"
    moved, still = ds.simulate(scene, 3.0, gesture=text), ds.simulate(roll, 3.0)
    assert len(moved.contacts) == len(still.contacts) > 60
    for name in ("t_in_s", "v_in_m_per_s", "peak_force_N"):
        np.testing.assert_allclose(moved.contacts[name], still.contacts[name], rtol=1e-9)


def test_a_hand_that_lifts_its_spring_takes_a_dead_stick_out_of_the_head() -> None:
    scene = ds.scene("grip", dv_pls=0.0)
    lifted = "t_s,z_m\n0,-0.02\n1,-0.02\n1.1,0.03\n1.5,0.03\n1.6,-0.02\n"
    run = ds.simulate(scene, 2.5, gesture=lifted)
    gaps = np.diff(run.contacts["t_in_s"])
    assert run.end == "time"
    assert gaps.max() > 0.5  # dead, then lifted
    assert run.contacts["t_in_s"][-1] > 1.5
    grip_only = ds.simulate(scene, 2.5)
    assert grip_only.end == "captured"  # a grip alone lifts nothing


@pytest.mark.parametrize("rows", ["0,-0.02\n1,-0.02\n", "0,-0.02\n0.5,-0.005\n1,-0.02\n"])
def test_a_hand_that_never_comes_above_the_head_leaves_a_dead_stick_to_be_thrown(rows: str) -> None:
    run = ds.simulate(ds.scene("grip", dv_pls=0.0), 2.5, gesture="t_s,z_m\n" + rows)
    assert run.end == "captured"


def test_a_hand_that_moves_plays_no_flights_that_gain() -> None:
    """The envelope judges those for the grip of [stick]; a looser one gains more: 1.5 m/s, where 0.8 is the most."""
    gains = NegativeDamping(r_N_s_per_m=2.0, below_m_per_s=0.5, where="above")
    scene = dataclasses.replace(GRIP, effects={"negative_damping": gains})
    with pytest.raises(ds.SceneError, match=r"cannot play \[effects.negative_damping\]"):
        ds.simulate(scene, 1.0)


def test_no_height_lies_below_that_of_the_stick() -> None:
    """A lower one than [stick] z_ss_m would be judged by nobody, not even at the guard's highest place."""
    high = dataclasses.replace(
        ds.scene("grip", z_ss=0.02), guard=dataclasses.replace(GRIP.guard, highest_m=0.01)
    )
    with pytest.raises(ds.SceneError, match="z_m"):
        ds.simulate(high, 1.0, gesture="t_s,z_m\n0,0.01\n1,0.01\n")


def test_what_is_set_moves_the_whole_gesture() -> None:
    """Half the K_hand of the scene: at each instant half the K_hand of the file."""
    hand, law = moving_hand.hand_of(GRIP, _gesture()), moving_hand.law_of(GRIP)
    law["k_hand"], law["z_ss"], law["r_in"] = 0.5 * law["k_hand"], -0.01, 0.12
    moving_hand.take(hand[0], law[0])
    path = moving_hand.path_of(GRIP, _gesture())
    moving_hand.look(hand[0], path, 4.0)
    moving_hand.hold(hand[0], law[0])
    assert law["k_hand"][0] == pytest.approx(0.5 * 27.1)
    assert law["r_out"][0] == pytest.approx(0.12)  # never tighter than in contact
    assert law["z_ss"][0] == pytest.approx(-0.01)


def test_analyse_says_what_it_does_with_a_moving_grip() -> None:
    found = ds.analyse(GRIP)
    assert found.note is not None
    assert "held still" in found.note
    assert [grip.t_s for grip in found.grips][:3] == [0.0, 0.5, 3.5]
    assert found.grips[2].rate_Hz == pytest.approx(30.05, abs=0.1)
    assert found.grips[-1].k_hand_N_per_m == pytest.approx(5.0)
    firm = dataclasses.replace(GRIP.stick, r_out_N_s_per_m=0.15)
    still = dataclasses.replace(GRIP, stick=firm, hand=ds.scene("roll").hand)
    assert found.grips[2].rate_Hz == pytest.approx(ds.analyse(still).cycles[0].rate_Hz, rel=1e-9)
    assert ds.analyse(ds.scene("roll")).grips == ()
    assert found.as_json()["grips"][2]["k_hand_N_per_m"] == pytest.approx(27.1)


def test_a_long_file_is_predicted_at_rows_evenly_chosen() -> None:
    rows = [f"{0.01 * k},{5.0 + 0.02 * k}" for k in range(1000)]
    gesture = gesture_of(["t_s,k_hand_N_per_m", *rows], "long.csv", GRIP)
    found = grips_of(GRIP, gesture)
    assert len(found) == 32
    assert found[0].k_hand_N_per_m == pytest.approx(5.0)


def test_steps_of_a_stepper_are_refused() -> None:
    with pytest.raises(ValueError, match="only the exact motion plays it"):
        ds.simulate(GRIP, 1.0, stepper=ds.Stepper("rk4", 1e-5))
