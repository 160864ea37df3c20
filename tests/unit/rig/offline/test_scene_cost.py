"""Cost of a scene, as the command tells it: every effect and every tier, numbers that can be numbers."""

import json
import math
import re

import pytest

from drumstick.drum import build, tiers
from drumstick.drum.build import Unplayable
from drumstick.drum.measurement import cost
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from rig.offline import scene_cost


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few ticks and frames: this is not about the figures."""
    for name, value in {"_TICKS": 500, "_REPEATS": 1, "_FRAMES": 600, "_STEPS_S": (1e-4,)}.items():
        monkeypatch.setattr(scene_cost, name, value)


@pytest.mark.usefixtures("quick")
def test_json_names_every_effect_method_and_tier(capsys: pytest.CaptureFixture[str]) -> None:
    scene_cost.cost("roll", as_json=True)
    found = json.loads(capsys.readouterr().out)
    assert found["scene"] == "roll"
    assert list(found["stick"]["effects"]) == ["pulse"]
    assert 20.0 < found["stick"]["contacts_per_s"] < 30.0  # without the pulse it would be thrown, and die
    assert set(found["sound"]["tiers"]) == set(scene_cost.ACCURACIES)
    assert found["sound"]["accuracy"] in scene_cost.ACCURACIES
    for tier in found["sound"]["tiers"].values():
        assert abs(tier["f01_error_cents"]) < 1.0
    assert {"drum.f01", "drum.t60"} <= found["sound"]["replacement_s"].keys()
    exact, *steppers = found["methods"]
    assert exact["method"] == "exact"
    assert exact["error_s"] == 0.0
    located, unlocated = steppers
    assert 0.0 < located["error_s"] < 1e-6 < unlocated["error_s"]
    assert all(math.isfinite(row["ns_per_tick"]) for row in found["methods"])


@pytest.mark.long
@pytest.mark.usefixtures("quick")
def test_table_marks_what_the_scene_asks_for(capsys: pytest.CaptureFixture[str]) -> None:
    scene_cost.cost("bare-drum", as_json=False)
    out = capsys.readouterr().out
    assert "* standard" in out
    assert "no effect at all" in out


@pytest.mark.parametrize("accuracy", ["fine", "standard", "draft"])
@pytest.mark.parametrize("effect", ["tension", "internal_loss", "cavity", "muffle"])
def test_what_an_effect_is_compared_with_has_the_same_order_and_rate(
    monkeypatch: pytest.MonkeyPatch, accuracy: str, effect: str
) -> None:
    """The drum without an effect may have another mesh, of another order or rate."""

    def order_and_rate(drum: Scene, rate_Hz: int) -> tuple[int, int]:
        divisor = tiers.divisor_for(drum, rate_Hz)
        return tiers.order_of(drum, rate_Hz / divisor), divisor

    told = f'[mesh]\naccuracy = "{accuracy}"\n[drum.effects.{effect}]\n'
    scene = parse(told, "x")
    tried: list[tuple[int, int, tuple[str, ...]]] = []

    def ringing(drum: Scene, rate_Hz: int, frames: int) -> cost.RingingCost:
        tried.append((*order_and_rate(drum, rate_Hz), tuple(drum.drum.effects)))
        return cost.RingingCost(1.0, 1, 1)

    monkeypatch.setattr(cost, "ringing", ringing)
    scene_cost._drum_effects(scene, lambda what: None)
    whole = order_and_rate(scene, 48_000)
    assert tried == [(*whole, effects) for _ in range(scene_cost._REPEATS) for effects in ((effect,), ())]


@pytest.mark.parametrize(
    ("name", "effect", "goes_with_it"), [("snare", "cavity", "snare"), ("timpani", "air", "kettle")]
)
def test_what_needs_an_effect_goes_with_it(
    monkeypatch: pytest.MonkeyPatch, name: str, effect: str, goes_with_it: str
) -> None:
    tried: list[set[str]] = []

    def ringing(drum: Scene, rate_Hz: int, frames: int) -> cost.RingingCost:
        build.new_engine(drum, rate_Hz, StrikeRing())
        tried.append(set(drum.drum.effects))
        return cost.RingingCost(1.0, 1, 1)

    monkeypatch.setattr(cost, "ringing", ringing)
    monkeypatch.setattr(scene_cost, "_REPEATS", 1)
    scene = parse(shipped_text(name), name)
    told = scene_cost._drum_effects(scene, lambda what: None)
    named = set(scene.drum.effects)
    assert tried[0] == named
    assert named - {effect, goes_with_it} in tried
    assert set(told) == named


@pytest.mark.long
@pytest.mark.usefixtures("quick")
def test_a_tier_that_cannot_be_is_told_and_the_others_measured(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    measured = scene_cost._tier

    def no_draft(tried: Scene) -> dict[str, object]:
        if tried.mesh.accuracy == "draft":
            raise Unplayable("no room for a wave")
        return measured(tried)

    monkeypatch.setattr(scene_cost, "_tier", no_draft)
    scene_cost.cost("bare-drum", as_json=False)
    out = capsys.readouterr().out
    assert re.search(r"draft +cannot be: no room for a wave", out)
    assert re.search(r"\* standard +\d+ ", out)


def test_a_head_that_takes_long_is_measured_less_and_what_is_not_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The clock is ours: each ringing of this drum takes a second, and eight seconds of it as many."""
    clock = [0.0]
    rung: list[Scene] = []

    def ringing(drum: Scene, rate_Hz: int, frames: int) -> cost.RingingCost:
        clock[0] += 1.0
        rung.append(drum)
        return cost.RingingCost(frames / rate_Hz, 200_000, frames)

    def no_pitch(drum: Scene, rate_Hz: int) -> float:
        raise AssertionError("it would take eight seconds")

    monkeypatch.setattr(scene_cost, "_now", lambda: clock[0])
    monkeypatch.setattr(cost, "ringing", ringing)
    monkeypatch.setattr(cost, "f01_error_cents", no_pitch)
    row = scene_cost._tier(Scene("huge"))
    assert len(rung) == 1
    assert row["f01_error_cents"] is None
    assert "not measured: 8 s of computing" in scene_cost._pitch(row)
    json.dumps(row, allow_nan=False)
    rung.clear()
    scene_cost._drum_effects(parse("[drum.effects.cavity]\n[drum.effects.snare]\n", "x"), lambda what: None)
    assert len(rung) == 3, "one round: the drum, and it without each effect"
