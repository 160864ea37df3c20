"""Effects' part of `accuracy`: costs, what leaving out changes, and composed against by hand."""

import json
from typing import Any

import numpy as np
import pytest

from drumstick.drum.effects.registry import DRUM_TABLES
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick.stick.motion.exact import ABOVE
from drumstick_lab.accuracy import effects, timing
from drumstick_lab.accuracy.drums import by_hand, drum_effects
from drumstick_lab.accuracy.drums.by_hand import Race
from drumstick_lab.accuracy.sticks import stick_effects

SLACK = 1.15


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """One effect each, and one round."""
    monkeypatch.setattr(drum_effects, "QUICK", ("uniform_loss",))
    monkeypatch.setattr(drum_effects, "_HEARD_S", 0.2)
    monkeypatch.setattr(stick_effects, "QUICK", ("pulse",))
    monkeypatch.setattr(stick_effects, "_TICKS", 500)
    monkeypatch.setattr(effects, "_QUICK_ROUNDS", 1)
    result: dict[str, Any] = {}
    for job in effects.jobs(True, result):
        job.run()
    return result


@pytest.mark.long
def test_rows_are_complete_and_json(found: dict[str, Any]) -> None:
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert [row["effect"] for row in found["sample"]] == ["none", "uniform_loss", "all"]
    for row in found["sample"]:
        assert set(row) == {"effect", "ns_per_sample", "added_ns", "spread_ns", "ratio", "changes_dB"}
        assert row["ns_per_sample"] > 0.0
    none, uniform, everything = found["sample"]
    assert none["changes_dB"] is None
    assert none["added_ns"] == 0.0
    assert -40.0 < uniform["changes_dB"] < 0.0
    assert everything["changes_dB"] > uniform["changes_dB"]
    assert [row["effect"] for row in found["tick"]] == ["none", "pulse", "all"]
    for row in found["tick"]:
        assert set(row) == {
            "effect", "ns_per_tick", "added_ns", "spread_ns", "ratio", "rate_Hz", "rate_without_Hz",
        }  # fmt: skip
    pulse = found["tick"][1]
    assert pulse["rate_Hz"] == pytest.approx(23.05, abs=0.05)
    assert pulse["rate_without_Hz"] is None  # a throw decays
    assert set(found["none"]) == {"ns_per_sample", "by_hand_ns", "over_by_hand"}
    ratio = found["none"]["ns_per_sample"] / found["none"]["by_hand_ns"]
    assert found["none"]["over_by_hand"] == pytest.approx(ratio)  # of the one round


def test_the_level_of_a_change() -> None:
    sound = np.random.default_rng(1).standard_normal((8192, 2)).astype(np.float32)
    assert drum_effects.changes(sound, sound) is None
    assert drum_effects.changes(sound, np.float32(0.5) * sound) == pytest.approx(-6.02, abs=0.01)
    assert drum_effects.changes(sound, -sound) is None  # what is not heard is no change


@pytest.mark.parametrize("effect", ["pulse", "system_delay"])
def test_a_stick_and_the_one_without_its_effect_go_through_the_same_contacts(effect: str) -> None:
    """Left to itself the stick of the roll without its pulse dies, and would be cheaper for that alone."""
    kept = stick_effects.states(stick_effects.scene_of(effect))
    other = stick_effects.bare(kept)
    in_head = kept["contact_phase"] != ABOVE
    assert 0.02 < in_head.mean() < 0.6
    assert np.abs(np.diff(in_head.astype(int))).sum() > 20
    for name in ("z", "v", "contact_phase", "outcome"):
        np.testing.assert_array_equal(kept[name], other[name])


def test_what_is_added_is_told_with_its_spread() -> None:
    assert timing.apart([5.0, 7.0, 6.5], [4.0, 4.0, 5.0]) == (1.5, 1.0)
    assert timing.apart([2.0, 2.0], [2.0, 2.0]) == (0.0, 0.0)


def test_every_effect_has_a_scene_that_names_it() -> None:
    assert list(stick_effects.NAMED_BY) == list(STICK_TABLES)
    for name in STICK_TABLES:
        assert name in stick_effects.scene_of(name).effects
    assert set(drum_effects.QUICK) < set(DRUM_TABLES)
    assert set(stick_effects.QUICK) < set(STICK_TABLES)


def test_a_snare_is_compared_with_the_head_that_it_lies_on() -> None:
    assert drum_effects.without("snare") == "cavity"
    assert drum_effects.without("rim") == drum_effects.NONE


def test_composed_and_by_hand_are_the_same_drum() -> None:
    race = Race(drum_effects.drum_with())
    for window in race.windows:
        assert window() > 0.0
    race.check()


def test_another_drum_by_hand_is_noticed() -> None:
    race = Race(drum_effects.drum_with())
    drum = race.drums[0]
    race.drums[0] = drum._replace(force_gain=1.01 * drum.force_gain)
    for window in race.windows:
        window()
    with pytest.raises(AssertionError, match="not the same drum"):
        race.check()
    assert by_hand.PLACE != (0.0, 0.0)
