"""Ends that strikes lead to: every edge judged by playing the exact stick from both sides of it."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import drumstick as ds
import stick_cases
from drumstick.analysis.cycles import basins as of_basins
from drumstick.analysis.cycles.basins import Basin
from drumstick.analysis.cycles.fixed_points import fixed_points
from drumstick.analysis.cycles.return_step import V_OUT, scratch_of
from drumstick.analysis.ends import Ends, ends_of
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.simulate import COLUMNS, simulate

SCENES = {
    "roll": ds.scene("roll"),
    "cor-roll": ds.scene("cor-roll"),
    "phantom": ds.scene("phantom"),
    # Four strikes that repeat, and between the ranges that lead there narrow ones that lead to rest.
    "many ranges": ds.scene("paper-roll", dv_pls=0.18),
}
BESIDE = 1e-6
V_IN_COLUMN = COLUMNS.index("v_in_m_per_s")
V_OUT_COLUMN = COLUMNS.index("v_out_m_per_s")


def _ends(scene: Scene) -> Ends:
    law, scratch = law_of(scene), scratch_of(scene)
    return ends_of(scene, law, scratch, fixed_points(law, scratch))


def _leads(scene: Scene, strike_m_per_s: float, basin: Basin, seconds: float = 60.0) -> bool:
    # Does the exact stick, played on from this strike without the map, end as the basin says?
    run = simulate(scene, seconds, -strike_m_per_s)
    if basin.cycle is None:
        return run.end == basin.end
    own = basin.cycle.states[:, V_OUT]
    last = run.contacts[-basin.cycle.period :, V_OUT_COLUMN]
    return run.end == "time" and bool(np.allclose(np.sort(last), np.sort(own), rtol=1e-6, atol=1e-9))


def _wrong(scene: Scene, ranges: list[Basin]) -> list[float]:
    # Edges beside which the stick does not end as told.
    return [
        above.from_m_per_s
        for below, above in itertools.pairwise(ranges)
        if not _leads(scene, below.to_m_per_s * (1.0 - BESIDE), below)
        or not _leads(scene, above.from_m_per_s * (1.0 + BESIDE), above)
    ]


@pytest.mark.parametrize("name", SCENES)
def test_both_sides_of_every_edge_end_as_told(name: str) -> None:
    scene = SCENES[name]
    ranges = list(_ends(scene).basins)
    assert len(ranges) > 1
    assert _wrong(scene, ranges) == []
    for basin in ranges:
        assert _leads(scene, 0.5 * (basin.from_m_per_s + basin.to_m_per_s), basin)


@pytest.mark.parametrize("off", [-1e-3, 1e-3])
def test_an_edge_that_is_a_thousandth_off_is_found_out(off: float) -> None:
    scene = SCENES["cor-roll"]
    below, above = _ends(scene).basins
    edge = above.from_m_per_s * (1.0 + off)
    moved = [dataclasses.replace(below, to_m_per_s=edge), dataclasses.replace(above, from_m_per_s=edge)]
    assert _wrong(scene, moved) == [edge]


def test_ends_are_counted_with_rest_and_with_longer_periods() -> None:
    assert _ends(SCENES["cor-roll"]).count == 2
    assert _ends(ds.scene("paper-roll")).count == 1
    assert _ends(stick_cases.scene(stick_cases.STICK_A)).count == 1
    found = _ends(SCENES["many ranges"])
    assert found.count == 2
    assert {basin.cycle.period for basin in found.basins if basin.cycle} == {4}


def test_the_edge_without_memory_is_the_unstable_cycle() -> None:
    """Pulses that are over before the next strike: the edge is the unstable roll's own strike."""
    found = ds.analyse(ds.scene("cor-roll", tau=1e-4))
    unstable = found.cycles[0]
    assert not unstable.stable
    assert found.ends is not None
    assert found.ends.basins[1].from_m_per_s == pytest.approx(-unstable.v_in_m_per_s, rel=1e-9)


def test_narrow_ranges_need_the_return_map(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scan of few speeds misses ranges; the map's turns and preimages lead to them."""
    scene = SCENES["many ranges"]
    monkeypatch.setattr(of_basins, "_NODES", 33)
    with_map = _ends(scene).basins
    monkeypatch.setattr(of_basins, "_preimages", lambda *_: [])
    monkeypatch.setattr(of_basins, "_turns", lambda *_: [])
    assert len(_ends(scene).basins) < len(with_map)


def _after_one_other_strike(scene: Scene, strike_m_per_s: float) -> float | None:
    # v_out long after a settled roll got one strike of another speed; None when the roll is over.
    law, motion = law_of(scene)[0], thrown(scene, scene.hand.throw_m_per_s)[0]
    strikes, v_out = 0, 0.0
    while motion["outcome"] == exact.MOVING and strikes < 600:
        event, _ = exact.advance(law, motion, 10.0)
        v_out = float(motion["v_out"]) if event == exact.RELEASE else v_out
        strikes += event == exact.ENTRY
        if event == exact.ENTRY and strikes == 300:
            motion["v"] = motion["v_in"] = -strike_m_per_s
    return v_out if motion["outcome"] == exact.MOVING else None


@pytest.mark.parametrize("name", ["roll", "phantom"])
def test_a_roll_withstands_as_much_as_told(name: str) -> None:
    """The pulse of `phantom` still acts at the next strike, so its limit is not the edge of a first strike."""
    scene = SCENES[name]
    (limits,) = _ends(scene).withstands
    assert limits.slowest_m_per_s is not None
    assert limits.fastest_m_per_s is None
    assert limits.least_m_per_s == limits.strike_m_per_s - limits.slowest_m_per_s
    assert _after_one_other_strike(scene, limits.slowest_m_per_s * (1.0 - BESIDE)) is None
    back = _after_one_other_strike(scene, limits.slowest_m_per_s * (1.0 + BESIDE))
    assert back == pytest.approx(limits.cycle.states[0, V_OUT], rel=1e-9)


_STICKS = st.builds(
    Stick,
    st.floats(0.01, 0.05),
    st.floats(2000.0, 8000.0),
    st.floats(0.5, 3.0),
    st.floats(5.0, 60.0),
    st.floats(0.05, 0.4),
    st.just(0.0) | st.floats(-0.03, 0.005),
    st.sampled_from(["paper", "unilateral"]),
)
_PULSES = st.builds(
    Pulse,
    st.floats(0.05, 1.0),
    st.floats(5e-4, 2e-2),
    st.sampled_from(["entry", "turn", "exit"]),
    st.sampled_from([1, -1]),
    st.sampled_from(["add", "replace", "ignore"]),
)


_A_ROLL_WITH_ONE_SLOW_STRIKE = (
    Stick(0.0207, 6122.0, 2.153, 26.01, 0.08493, 0.0, "paper"),
    Pulse(0.364, 0.0109, "entry", -1, "ignore"),
)


def test_a_roll_with_a_strike_slower_than_all_that_were_looked_at_has_its_limits() -> None:
    """A roll of three strikes that only playing on finds: its slowest is below every speed of the scan."""
    scene = stick_cases.scene(*_A_ROLL_WITH_ONE_SLOW_STRIKE)
    found = _ends(scene)
    own = -simulate(scene, 60.0, -0.3).contacts[-3:, V_IN_COLUMN]
    assert min(own) < found.basins[0].from_m_per_s
    (limits,) = found.withstands
    assert min(abs(limits.strike_m_per_s / own - 1.0)) < 1e-6


@pytest.mark.long
@settings(max_examples=25, deadline=None)
@given(_STICKS, _PULSES, st.floats(0.0, 1.0))
@example(*stick_cases.BALANCED, 0.5).via(
    "its numbers became too small to tell a sign, 13 s after it came to rest"
)
@example(*_A_ROLL_WITH_ONE_SLOW_STRIKE, 0.5).via(
    "one strike of three slower than any speed that was looked at"
)
def test_any_likely_stick_ends_as_told(stick: Stick, pulse: Pulse, where: float) -> None:
    """A strike of any speed in the range; not where what follows takes longer to settle than is played here."""
    scene = stick_cases.scene(stick, pulse)
    ranges = _ends(scene).basins
    speed = ranges[0].from_m_per_s * (ranges[-1].to_m_per_s / ranges[0].from_m_per_s) ** where
    basin = next(b for b in ranges if b.from_m_per_s <= speed <= b.to_m_per_s)
    assume(basin.end != "unsettled")
    assume(basin.cycle is None or (abs(basin.cycle.multiplier) < 0.98 and basin.cycle.rate_Hz < 1e3))
    assume(all(abs(b.from_m_per_s / speed - 1.0) > 1e-3 for b in ranges))
    assert _leads(scene, speed, basin)
