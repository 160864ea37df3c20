"""Two hands with a stick each: the traditional double-stroke roll, which no pulse keeps going."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy import integrate

import drumstick as ds
from drumstick.analysis.hand_work import hand_work
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import SceneError, parse, shipped_text
from drumstick.stick import hands
from drumstick.stick.simulate import COLUMNS, Stepper, TooLong

SCENE = parse(shipped_text("double-stroke"), "double-stroke")
ROLL = parse(shipped_text("roll"), "roll")
PERIOD_S = SCENE.hand.gesture_period_s
T_IN, V_IN, T_OUT, V_OUT = (
    COLUMNS.index(name) for name in ("t_in_s", "v_in_m_per_s", "t_out_s", "v_out_m_per_s")
)
_integrate: Any = integrate  # scipy publishes no types


def _hand_m(scene: Scene, t: float) -> float:
    # The gesture written down once more: lifted for 0.3 s, then down along a cosine, low for half a period, and up.
    turn = math.cos(2.0 * math.pi * max(t - 0.3, 0.0) / scene.hand.gesture_period_s)
    return scene.stick.z_ss_m + scene.hand.gesture_height_m * max(turn, 0.0)


class _Integrated:
    """One stick by scipy, from equations (1) and (2) alone, and the energy that its dampers take."""

    def __init__(self, scene: Scene, late_s: float) -> None:
        self.scene, self.late_s = scene, late_s
        self.hand_m = _hand_m(scene, 0.0)
        self.t, self.state = 0.0, [self.hand_m, 0.0, 0.0]
        self.phase, self.work_J = "above", 0.0
        self.rows: list[list[float]] = []

    def _rates(self, _: float, y: Any) -> list[float]:
        stick, (z, v, _) = self.scene.stick, y
        k, r = (
            (stick.k_coll_N_per_m, stick.r_in_N_s_per_m)
            if self.phase == "contact"
            else (0.0, stick.r_out_N_s_per_m)
        )
        force = -k * z - r * v - stick.k_hand_N_per_m * (z - self.hand_m)
        return [v, force / stick.m_kg, r * v * v]

    def _push(self, y: Any) -> float:
        stick = self.scene.stick
        return -stick.k_coll_N_per_m * y[0] - (stick.r_in_N_s_per_m - stick.r_out_N_s_per_m) * y[1]

    def _ends(self) -> Any:
        phase = self.phase

        def ends(t: float, y: Any) -> float:
            return self._push(y) if phase == "contact" else y[0]

        ends.terminal = True  # ty: ignore[unresolved-attribute]  scipy looks for them
        ends.direction = 1.0 if phase == "loose" else -1.0  # ty: ignore[unresolved-attribute]
        return ends

    def tick(self, end_s: float) -> None:
        """Step the hand, then on to `end_s`."""
        stick, to_m = self.scene.stick, _hand_m(self.scene, self.t - self.late_s)
        z = self.state[0]
        self.work_J += 0.5 * stick.k_hand_N_per_m * ((to_m - z) ** 2 - (self.hand_m - z) ** 2)
        self.hand_m = to_m
        while self.t < end_s:
            run = _integrate.solve_ivp(
                self._rates,
                (self.t, end_s),
                self.state,
                "DOP853",
                events=self._ends(),
                rtol=1e-13,
                atol=1e-17,
            )
            self.t, self.state = float(run.t[-1]), run.y[:, -1].tolist()
            if run.status != 1:
                return
            if self.phase == "contact":
                self.phase = "loose"
                # What the head's spring still holds when it lets go is lost to the stick.
                self.state[2] += 0.5 * stick.k_coll_N_per_m * self.state[0] ** 2
                continue
            self.state[0] = 0.0
            if self.phase == "above":
                self.phase = "contact"
                self.rows.append([self.t, self.state[1]])
            else:
                self.phase = "above"
                self.rows[-1] += [self.t, self.state[1]]

    def stored_joules(self) -> float:
        """Energy of the stick and of its hand's spring, above the head."""
        z, v, _ = self.state
        stick = self.scene.stick
        return 0.5 * stick.m_kg * v * v + 0.5 * stick.k_hand_N_per_m * (z - self.hand_m) ** 2


@pytest.mark.parametrize("hand", [0, 1])
def test_another_integrator_plays_the_same(hand: int) -> None:
    """Instants, speeds and the hand's work to 1e-9; and the work is what was lost and stored."""
    lasts_s = 0.3 + 2.0 * PERIOD_S + 0.5 * hand * PERIOD_S
    played = hands.play(SCENE, lasts_s)
    other = _Integrated(SCENE, 0.5 * hand * PERIOD_S)
    for tick in range(played.work_J.shape[1] - 1):
        other.tick((tick + 1) * played.tick_s)
    rows = played.contacts[played.hand == hand]
    expected = np.array([row for row in other.rows if len(row) == 4])
    assert len(expected) >= 4
    np.testing.assert_allclose(rows[:, [T_IN, V_IN, T_OUT, V_OUT]], expected, rtol=1e-9, atol=0.0)
    assert played.work_J[hand, -1] == pytest.approx(other.work_J, rel=1e-9)
    assert other.phase == "above"
    assert other.work_J == pytest.approx(other.state[2] + other.stored_joules(), rel=1e-9)


def test_each_hand_throws_lets_bounce_and_lifts_in_turn() -> None:
    """Two strikes of one hand, the second softer, then two of the other: four a period, for half a minute."""
    played = hands.play(SCENE, 30.0)
    settled = played.contacts[:, T_IN] > 0.3 + 8.0 * PERIOD_S
    hand, speed = played.hand[settled], -played.contacts[settled, V_IN]
    first = int(np.flatnonzero(np.diff(hand) != 0)[0]) + 1
    hand, speed = hand[first:], speed[first:]
    whole = len(hand) // 4 * 4
    turns = hand[:whole].reshape(-1, 4)
    assert len(turns) > 100
    assert (turns == turns[0]).all()
    assert turns[0, 0] == turns[0, 1] != turns[0, 2] == turns[0, 3]
    pairs = speed[:whole].reshape(-1, 2)
    assert (pairs[:, 1] < pairs[:, 0]).all()


def test_what_it_costs_beside_the_one_handed_roll() -> None:
    """Its hands give it all, and less evenly; of the one-handed roll the drum gives all, and the hand nothing."""
    two, one = hand_work(SCENE), hand_work(ROLL)
    assert two.rate_Hz == pytest.approx(4.0 / PERIOD_S, rel=1e-3)
    assert two.hands_W[0] == pytest.approx(two.hands_W[1], rel=0.01)
    assert min(two.hands_W) > 5e-3
    assert two.drum_W == 0.0
    assert one.hands_W == (0.0,)
    assert one.drum_W > 0.02
    assert one.rate_Hz > 1.3 * two.rate_Hz
    assert one.interval_variation < 1e-9 < 0.05 < two.interval_variation < 0.15
    # The head takes (1 - beta^2) of each blow's energy, the hand's damper the rest of what the hands give.
    head_W = 0.5 * SCENE.stick.m_kg * float(np.mean(two.strikes[:, 1] ** 2)) * (1.0 - 0.79**2) * two.rate_Hz
    assert 0.3 * sum(two.hands_W) < head_W < sum(two.hands_W)


def test_half_of_every_length_is_a_quarter_of_the_work() -> None:
    """All is linear in lengths; so a softer roll of the same rhythm costs the square."""
    half = dataclasses.replace(
        SCENE,
        stick=dataclasses.replace(SCENE.stick, z_ss_m=0.5 * SCENE.stick.z_ss_m),
        hand=dataclasses.replace(SCENE.hand, gesture_height_m=0.5 * SCENE.hand.gesture_height_m),
    )
    whole, small = hand_work(SCENE), hand_work(half)
    assert small.interval_variation == pytest.approx(whole.interval_variation, rel=1e-6)
    assert small.hands_W[0] == pytest.approx(0.25 * whole.hands_W[0], rel=1e-6)


def test_simulate_has_both_sticks() -> None:
    run = ds.simulate(SCENE, 3.0)
    played = hands.play(SCENE, 3.0)
    np.testing.assert_array_equal(run.contacts["t_in_s"], played.contacts[:, T_IN])
    assert (np.diff(run.contacts["t_in_s"]) > 0.0).all()
    assert run.rate_Hz == pytest.approx(16.0, rel=0.02)
    assert len(run.drum_strikes()) == len(run.contacts)
    with pytest.raises(ValueError, match="two sticks"):
        run.motion([0.5])
    with pytest.raises(ValueError, match="only the exact motion"):
        ds.simulate(SCENE, 1.0, stepper=Stepper("rk4", 1e-5))
    with pytest.raises(TooLong, match="3600 s at most"):
        ds.simulate(SCENE, 1e5)
    with pytest.raises(TooLong, match="more than 10 contacts"):
        ds.simulate(SCENE, 30.0, most_contacts=10)
    most = int((played.hand == 0).sum())
    assert most == max(most, (played.hand == 1).sum())
    assert len(hands.play(SCENE, 3.0, most).contacts) == len(played.contacts)
    with pytest.raises(TooLong, match=f"more than {most - 1} contacts"):
        hands.play(SCENE, 3.0, most - 1)


def test_a_stick_that_dies_away_on_the_head_strikes_no_more_until_it_is_lifted() -> None:
    """The hand rests right at the head, z_ss = 0: from 1e-30 m/s on there were contacts without end."""
    rests = dataclasses.replace(
        SCENE,
        stick=dataclasses.replace(SCENE.stick, z_ss_m=0.0, r_in_N_s_per_m=3.0),
        hand=dataclasses.replace(SCENE.hand, gesture_period_s=60.0),
    )
    played = hands.play(rests, 0.3 + 2.0 * 60.0)
    rows = played.contacts[played.hand == 0]
    assert (rows[:, V_IN] <= -1e-30).all()
    turns = [rows[(rows[:, T_IN] // 60.0) == turn] for turn in (0, 1)]
    assert len(turns[0]) == len(turns[1]) > 50
    np.testing.assert_allclose(turns[1][:20, T_IN] - 60.0, turns[0][:20, T_IN], rtol=1e-6)
    np.testing.assert_allclose(turns[1][:20, V_IN], turns[0][:20, V_IN], rtol=1e-3)


def test_hands_that_are_lifted_too_little_play_no_roll() -> None:
    """The sticks stay in the head."""
    low = shipped_text("double-stroke").replace("gesture_height_m = 0.018", "gesture_height_m = 0.001")
    scene = parse(low, "low")
    assert scene.hand.gesture_height_m == 0.001
    found = ds.analyse(scene)
    assert found.hand_work is None
    assert found.note is not None
    assert "the hands play no roll" in found.note


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (('gesture = "double-stroke-roll"', 'gesture = "hold"'), "take turns in a gesture"),
        (("[drum]", '[device]\nplant = "phantom"\n\n[drum]'), "not played by an arm"),
        (("[drum]", '[drum]\nexcitation = "streamed"'), "heard by their strikes"),
    ],
)
def test_what_two_hands_cannot_do_is_refused_by_its_line(changed: tuple[str, str], words: str) -> None:
    with pytest.raises(SceneError, match=rf"scene:\d+: hand.hands: .*{words}"):
        parse(shipped_text("double-stroke").replace(*changed), "scene")
