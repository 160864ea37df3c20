"""Rate and level apart: the inverse of the prediction, and rolls that grow louder or faster on the way there."""

import math

import numpy as np
import pytest

from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.cycles.settling import settle
from drumstick.analysis.inverse import UNCHANGED, Inverse, Roll, Unreachable, moved
from drumstick.analysis.ramp import STEP_S, Leg, Ramp
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal, table_of, with_changes
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.strike_curve import level_at

_SETTLING_S, _TOLERANCE = 2.0, 0.01


def _scene(name: str) -> Scene:
    return parse(shipped_text(name), name)


def _within(found: Roll, rate_Hz: float, level: float) -> bool:
    return abs(found.rate_Hz / rate_Hz - 1.0) <= _TOLERANCE and abs(found.level / level - 1.0) <= _TOLERANCE


def _require_predicted(scene: Scene, found: Roll) -> None:
    # The prediction itself says so, and the envelope takes it.
    envelope.require(found.law, envelope.Limits.of(scene))
    cycle = settle(found.law, scratch_of(scene), scene.hand.throw_m_per_s).cycle
    assert cycle is not None
    assert cycle.stable
    assert cycle.period == 1
    assert _within(found, cycle.rate_Hz, level_at(scene.strike, -cycle.v_in_m_per_s))


@pytest.mark.parametrize("name", ["roll", "phantom"])
def test_a_hundred_targets_each_are_met_or_refused_with_the_nearest(name: str) -> None:
    scene = _scene(name)
    inverse = Inverse(scene)
    now = inverse.present(law_of(scene))
    random = np.random.default_rng(20070)
    met = 0
    for _ in range(100):
        rate, level = (float(x) for x in np.exp(random.uniform(np.log([4.0, 0.02]), np.log([80.0, 1.0]))))
        try:
            found = inverse.towards(now, rate, level)
        except Unreachable as refusal:
            _require_predicted(scene, refusal.nearest)
            near = refusal.nearest
            assert f"nearest: {near.rate_Hz:.3g} Hz at level {near.level:.3g}" in str(refusal)
        else:
            met += 1
            assert _within(found, rate, level)
            _require_predicted(scene, found)
    assert 20 < met < 100


def test_nearest_is_at_the_border() -> None:
    inverse = Inverse(_scene("phantom"))
    now = inverse.present(law_of(_scene("phantom")))
    with pytest.raises(Unreachable, match=r"needs .* the limit is 8\.5 N: .* nearest: 16 Hz") as caught:
        inverse.towards(now, level=0.9)
    nearest = caught.value.nearest
    assert inverse.towards(now, level=nearest.level).level == pytest.approx(nearest.level)
    with pytest.raises(Unreachable):
        inverse.towards(now, level=1.01 * nearest.level)


def test_there_and_back_again_gives_the_same_values() -> None:
    inverse = Inverse(_scene("roll"))
    now = inverse.present(law_of(_scene("roll")))
    there = inverse.towards(inverse.towards(now, rate_Hz=35.0), level=0.8)
    back = inverse.towards(inverse.towards(there, level=now.level), rate_Hz=now.rate_Hz)
    assert moved(back.law) == pytest.approx(moved(now.law), rel=1e-6)


@pytest.mark.parametrize("of", [1.0 - 0.9 * UNCHANGED, 1.0 + 0.9 * UNCHANGED])
def test_what_holds_already_changes_nothing(of: float) -> None:
    inverse = Inverse(_scene("roll"))
    now = inverse.present(law_of(_scene("roll")))
    assert inverse.towards(now, rate_Hz=of * now.rate_Hz) is now
    assert inverse.towards(now, level=of * now.level) is now
    assert inverse.towards(now, rate_Hz=of**2 * now.rate_Hz) is not now


def test_from_values_that_make_no_roll_it_starts_from_the_scene() -> None:
    scene = _scene("roll")
    captured = with_changes(law_of(scene), table_of(scene), {"k_hand": 200.0})
    inverse = Inverse(scene)
    assert inverse.roll(captured) is None
    found = inverse.towards(inverse.present(captured), rate_Hz=30.0)
    assert _within(found, 30.0, inverse.present(law_of(scene)).level)


@pytest.mark.parametrize("name", ["cor-roll", "bare-drum"])
def test_scene_without_a_steady_roll_by_pulse_says_so(name: str) -> None:
    with pytest.raises(Refusal, match=r"no pulse .* it makes no roll"):
        Inverse(_scene(name))


@pytest.mark.parametrize("name", ["grip", "accents"])
def test_scene_whose_hand_moves_by_its_gesture_says_so(name: str) -> None:
    with pytest.raises(Refusal, match=r"moves as its gesture says .* it makes no roll"):
        Inverse(_scene(name))


@pytest.mark.parametrize(
    ("rate_Hz", "level"),
    [(0.0, None), (math.nan, None), (1e9, None), (None, 0.0), (None, 1.01), (None, math.nan)],
)
def test_what_is_no_rate_and_no_level_is_refused(rate_Hz: float | None, level: float | None) -> None:
    inverse = Inverse(_scene("roll"))
    with pytest.raises(Refusal, match="outside"):
        inverse.towards(inverse.present(law_of(_scene("roll"))), rate_Hz, level)


def _played(scene: Scene, law: Records, ramp: Ramp, duration_s: float) -> tuple[np.ndarray, np.ndarray]:
    # Instants and speeds of the contacts of a roll that settles, and is then led along the ramp: in virtual time, and
    # as a servo takes sets, whole and above the head only.
    table, motion, live = table_of(scene), thrown(scene, scene.hand.throw_m_per_s), law.copy()
    contacts: list[tuple[float, float]] = []
    now, due = -_SETTLING_S, 0.0
    while now < duration_s:
        event, gone = exact.advance(live[0], motion[0], due - now)
        now += gone
        if event == exact.ENTRY:
            contacts.append((now, -float(motion["v_in"][0])))
        if now >= due:
            wanted = with_changes(live, table, ramp.at(due))
            due += STEP_S
        if now > 0.0 and motion["contact_phase"][0] == exact.ABOVE:
            live = wanted
    times, speeds = np.array(contacts).T
    return times, speeds


_WAYS = {"crescendo": (1.0, 2.0), "diminuendo": (1.0, 0.3), "accelerando": (1.5, 1.0), "both": (0.6, 1.8)}


@pytest.mark.parametrize("name", ["roll", "snare"])
@pytest.mark.parametrize("way", _WAYS)
def test_rate_and_level_go_their_own_ways(name: str, way: str) -> None:
    scene = _scene(name)
    inverse, law = Inverse(scene), law_of(scene)
    start, (of_rate, of_level) = inverse.present(law), _WAYS[way]
    legs = Leg(of_rate * start.rate_Hz, 3.0), Leg(of_level * start.level, 2.5)
    ramp, end = inverse.ramp(start, *legs)
    times, speeds = _played(scene, law, ramp, 4.0)
    instants, middles = times[1:], 0.5 * (times[1:] + times[:-1])
    ours = middles > -0.5
    wanted_Hz = np.array([ramp.stands_at(t).rate_Hz for t in middles])
    wanted_m_per_s = np.array([ramp.stands_at(t).speed_m_per_s for t in instants])
    assert np.max(np.abs(1.0 / np.diff(times) / wanted_Hz - 1.0)[ours]) < 0.01
    assert np.max(np.abs(20.0 * np.log10(speeds[1:] / wanted_m_per_s))[ours]) < 0.5
    assert _within(end, of_rate * start.rate_Hz, of_level * start.level)
