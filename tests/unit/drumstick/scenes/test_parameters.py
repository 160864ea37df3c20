"""The parameter table: what a scene has is what can be set; refusals say why and change nothing."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import GRAVITY_M_PER_S2
from drumstick.scenes.scene_text import SceneError, parse, shipped_text
from drumstick.scenes.table import (
    Parameter,
    Refusal,
    scene_values,
    scene_with,
    table_of,
    values_of,
    with_changes,
)
from drumstick.stick.law import law_of, law_type, live_in_drum

ROLL = parse(shipped_text("roll"), "roll")
TABLE = table_of(ROLL)
DRUM_NAMES = ["drum.f01", "drum.t60", "listen.gain", "listen.pan", "listen.mute"]
STICK_NAMES = ["m", "k_coll", "r_in", "k_hand", "r_out", "z_ss"]
REFUSED = {
    "unknown": ({"k_col": 1.0}, ["k_col", "no such parameter", "k_coll"]),
    "too large": ({"k_coll": 2e6}, ["k_coll", "2e+06 N/m", "1 .. 1e+06 N/m"]),
    "too small": ({"m": 0.0}, ["m", "0 kg", "0.0001 .. 1 kg"]),
    "nan": ({"r_in": math.nan}, ["r_in", "nan", "finite", "0 .. 1000 N s/m"]),
    "infinite": ({"dv_pls": math.inf}, ["dv_pls", "inf", "finite", "m/s"]),
    "two views of one value": ({"z_h0": 0.0, "z_ss": 0.0}, ["z_h0", "z_ss", "only one"]),
    "z_h0 that puts z_ss out of range": ({"z_h0": -1.0, "m": 1.0, "k_hand": 1.0}, ["z_ss", "-1 .. 1 m"]),
    "z_h0 without a hand": ({"z_h0": 0.1, "k_hand": 0.0}, ["z_h0", "k_hand"]),
    "one wrong among good ones": (
        {"dv_pls": 0.3, "tau": 7.0, "k_coll": 4000.0},
        ["tau", "7 s", "1e-06 .. 1 s"],
    ),
}


def test_a_scene_has_its_stick_its_effects_z_h0_and_its_drum() -> None:
    assert list(table_of(Scene("bare"))) == [*STICK_NAMES, "z_h0", *DRUM_NAMES]
    assert list(TABLE) == [*STICK_NAMES, "dv_pls", "tau", "z_h0", *DRUM_NAMES]
    assert TABLE["dv_pls"].effect == "pulse"
    with pytest.raises(Refusal, match="dv_pls: no such parameter"):
        with_changes(law_of(Scene("bare")), table_of(Scene("bare")), {"dv_pls": 0.1})


def test_a_mallet_is_set_where_the_scene_has_one() -> None:
    scene = parse('[drum]\nexcitation = "mallet"\n[mallet]\nmaterial = "felt"\n', "felt")
    names = [name for name in table_of(scene) if name.startswith("mallet.")]
    assert names == ["mallet.mass", "mallet.stiffness", "mallet.exponent", "mallet.loss", "mallet.tip_radius"]
    assert scene_values(scene)["mallet.mass"] == 0.03
    assert all(table_of(scene)[name].quantity.rebuilds for name in names)
    changed = scene_with(scene, {"mallet.mass": 0.1, "mallet.tip_radius": 0.01})
    assert changed.mallet is not None
    assert (changed.mallet.mass_kg, changed.mallet.tip_radius_m, changed.mallet.exponent) == (0.1, 0.01, 2.5)
    with pytest.raises(Refusal, match=r"mallet\.mass: 2 kg is outside 0\.001 \.\. 1 kg"):
        scene_with(scene, {"mallet.mass": 2.0})
    with pytest.raises(Refusal, match=r"mallet\.mass: no such parameter"):
        scene_with(ROLL, {"mallet.mass": 0.1})


def test_pickups_are_set_where_the_scene_asks_for_it() -> None:
    listen = "[listen]\npickups = [[-0.7, 0.3, -0.6], [0.7, 0.25, 0.6]]\n"
    stays, scene = parse(listen, "stays"), parse(f'{listen}pickup_places = "live"\n', "live")
    names = ["pickup-1.x", "pickup-1.y", "pickup-2.x", "pickup-2.y"]
    assert list(table_of(stays)) == [*STICK_NAMES, "z_h0", *DRUM_NAMES]
    assert list(table_of(scene)) == [*table_of(stays), *names]
    assert law_of(stays).tobytes() == law_of(Scene("bare")).tobytes()
    assert [scene_values(scene)[name] for name in names] == [-0.7, 0.3, 0.7, 0.25]
    moved = scene_with(scene, {"pickup-1.x": 0.0, "pickup-2.y": -0.5})
    assert moved.listen.pickups == ((0.0, 0.3, -0.6), (0.7, -0.5, 0.6))
    outside = r"pickup 1 at x 0\.9, y 0\.6 of the radius is 1\.08 from the middle, outside the rim, at most 1 of the"
    with pytest.raises(Refusal, match=outside):
        scene_with(scene, {"pickup-1.x": 0.9, "pickup-1.y": 0.6})
    with pytest.raises(Refusal, match=r"pickup-1\.x: 1\.5 of the radius is outside -1 \.\. 1 of the radius"):
        scene_with(scene, {"pickup-1.x": 1.5})
    with pytest.raises(Refusal, match=r"pickup-1\.x: no such parameter"):
        scene_with(ROLL, {"pickup-1.x": 0.1})


def test_a_pickup_at_the_rim_is_taken_in_single_precision_as_osc_brings_it() -> None:
    scene = parse('[listen]\npickup_places = "live"\n', "live")
    x, y = float(np.float32(0.6)), float(np.float32(0.8))
    assert math.hypot(x, y) > 1.0
    assert scene_with(scene, {"pickup-1.x": x, "pickup-1.y": y}).listen.pickups[0][:2] == (x, y)


@pytest.mark.parametrize(
    ("listen", "words"),
    [
        ("pickups = [[0.9, 0.6, 0.0]]", "scene:2: listen.pickups: pickup 1 at x 0.9, y 0.6"),
        ("microphones = [[0.0, 0.0, 0.5, 0.0]]", 'scene:3: listen.pickup_places: "live" is for pickups'),
    ],
)
def test_pickups_that_can_be_moved_are_on_the_head_and_heard(listen: str, words: str) -> None:
    text = f'[listen]\n{listen}\npickup_places = "live"\n'
    with pytest.raises(SceneError) as refused:
        parse(text, "scene")
    assert words in str(refused.value)
    fixed = text.replace("live", "fixed")
    assert len(table_of(parse(fixed, "scene"))) == len(table_of(Scene("bare")))


@pytest.mark.parametrize("case", REFUSED)
def test_a_refusal_says_why_and_changes_nothing(case: str) -> None:
    changes, words = REFUSED[case]
    law = law_of(ROLL)
    before = law.tobytes()
    with pytest.raises(Refusal) as refused:
        with_changes(law, TABLE, changes)
    for word in words:
        assert word in str(refused.value)
    assert law.tobytes() == before


def test_an_accepted_set_is_a_new_law_and_holds_every_value() -> None:
    law = law_of(ROLL)
    before = law.tobytes()
    changes = {"dv_pls": 0.3, "tau": 0.004, "k_coll": 4000.0, "z_ss": -0.01}
    changed = with_changes(law, TABLE, changes)
    assert law.tobytes() == before
    values = values_of(changed, TABLE)
    assert {name: values[name] for name in changes} == changes
    untouched = set(TABLE) - set(changes) - {"z_h0"}
    assert {name: values[name] for name in untouched} == {
        name: value for name, value in values_of(law, TABLE).items() if name in untouched
    }


def test_z_h0_is_another_view_of_z_ss() -> None:
    """z_ss = z_h0 - m g*/K_hand: raising k_hand leaves z_ss, setting z_h0 moves it."""
    law = law_of(ROLL)
    sag = 0.015 * GRAVITY_M_PER_S2 / 20.0
    assert values_of(law, TABLE)["z_h0"] == pytest.approx(-0.02 + sag)
    lowered = with_changes(law, TABLE, {"z_h0": -0.03})
    assert values_of(lowered, TABLE)["z_ss"] == pytest.approx(-0.03 - sag)
    stiffer = values_of(with_changes(law, TABLE, {"k_hand": 40.0}), TABLE)
    assert stiffer["z_ss"] == -0.02
    assert stiffer["z_h0"] == pytest.approx(-0.02 + 0.5 * sag)


def test_z_h0_has_no_value_without_a_hand() -> None:
    assert math.isnan(values_of(with_changes(law_of(ROLL), TABLE, {"k_hand": 0.0}), TABLE)["z_h0"])


@pytest.mark.parametrize("row", TABLE.values(), ids=list(TABLE))
@given(share=st.floats(0.0, 1.0))
def test_norm_comes_back(row: Parameter, share: float) -> None:
    value = row.from_norm(share)
    assert row.check(value) == value
    assert row.norm(value) == pytest.approx(share, abs=1e-9)


@pytest.mark.parametrize("row", TABLE.values(), ids=list(TABLE))
def test_norm_ends_at_the_limits_and_grows(row: Parameter) -> None:
    assert row.from_norm(0.0) == pytest.approx(row.quantity.low, rel=1e-12)
    assert row.from_norm(1.0) == pytest.approx(row.quantity.high, rel=1e-12)
    values = [row.from_norm(share) for share in np.linspace(0.0, 1.0, 101)]
    assert all(below < above for below, above in itertools.pairwise(values))


@given(st.dictionaries(st.sampled_from([*TABLE, "nonsense"]), st.floats()))
def test_any_set_is_accepted_whole_or_refused(changes: dict[str, float]) -> None:
    law = law_of(ROLL)
    before = law.tobytes()
    try:
        values = values_of(with_changes(law, TABLE, changes), TABLE)
    except Refusal as refusal:
        assert str(refusal)
    else:
        for name, value in changes.items():
            assert values[name] == pytest.approx(value, rel=1e-9, abs=1e-9)
            assert math.isfinite(value)
    assert law.tobytes() == before


def test_the_same_stick_on_another_drum_has_the_same_record_and_needs_no_other_kernels() -> None:
    snare = parse(shipped_text("snare"), "snare")
    assert list(ROLL.effects) == list(snare.effects)
    assert len(live_in_drum(ROLL)) < len(live_in_drum(snare))
    assert law_of(ROLL).dtype == law_of(snare).dtype
    for scene in (ROLL, snare):
        values, drum = values_of(law_of(scene), table_of(scene)), live_in_drum(scene)
        assert {name: values[name] for name in drum} == {name: value for name, (_, value) in drum.items()}


@pytest.mark.parametrize("live", [0, 16, 17, 33])
def test_there_is_a_place_for_each_live_value_of_a_drum(live: int) -> None:
    assert law_type((), live)["drum"].shape[0] >= live
