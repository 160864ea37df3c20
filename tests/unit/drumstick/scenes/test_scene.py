"""Scenes: every mistake is refused with file, line, key, value, limit and unit; what is read comes back as it was."""

import dataclasses
import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.drum.effects.registry import DRUM_TABLES, MESH_EFFECTS, MESH_PICKUPS_ONLY, MODAL_EFFECTS
from drumstick.parameters.declare import quantities
from drumstick.parameters.drum import Modal
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.scene import Scene
from drumstick.parameters.strike import Strike
from drumstick.scenes.scene_text import SceneError, as_tables, from_tables, parse, shipped_names, shipped_text
from drumstick.scenes.table import table_of
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick.stick.law import law_of, thrown

HEAD = 'name = "x"\n\n[stick]\n'
# text -> the line the message must name, and the words that it must hold
REFUSED = {
    "above the range": (HEAD + "m_kg = 2.0\n", 4, ["stick.m_kg", "2.0 kg", "0.0001 .. 1 kg"]),
    "below the range": (
        HEAD + "\nk_coll_N_per_m = 0.5\n",
        5,
        ["stick.k_coll_N_per_m", "0.5", "1 .. 1e+06 N/m"],
    ),
    "not a number": (
        HEAD + 'r_in_N_s_per_m = "high"\n',
        4,
        ["stick.r_in_N_s_per_m", "'high'", "number in N s/m"],
    ),
    "a truth value": (
        HEAD + "r_in_N_s_per_m = true\n",
        4,
        ["stick.r_in_N_s_per_m", "True", "number in N s/m"],
    ),
    "nan": (HEAD + "z_ss_m = nan\n", 4, ["stick.z_ss_m", "nan", "finite number in m"]),
    "infinite": (HEAD + "z_ss_m = -inf\n", 4, ["stick.z_ss_m", "-inf", "finite number in m"]),
    "unknown key": (HEAD + "mass = 0.1\n", 4, ["stick.mass", "unknown key", "m_kg", "z_ss_m"]),
    "unknown word": (
        HEAD + 'release = "never"\n',
        4,
        ["stick.release", "'never'", "'paper'", "'unilateral'"],
    ),
    "a gesture without its file": (
        '[hand]\ngesture = "recorded"\n[device]\nplant = "phantom"\n',
        1,
        ["hand.gesture_file", "missing", "t_s and z_m"],
    ),
    "a file without its gesture": (
        '[hand]\ngesture = "strokes"\ngesture_file = "mine.csv"\n',
        3,
        ["hand.gesture_file", 'only by gesture = "recorded"'],
    ),
    "a gesture file of two lines": (
        '[hand]\ngesture_file = "mine\\n.csv"\n',
        2,
        ["hand.gesture_file", "one line of text"],
    ),
    "unknown table": (HEAD + "\n[sticks]\nm_kg = 0.1\n", 5, ["sticks", "unknown key", "stick", "guard"]),
    "unknown effect": ("[effects.puls]\ntau_s = 1.0\n", 1, ["effects.puls", "unknown effect", "pulse"]),
    "in an effect": ("[effects.pulse]\n\ntau_s = 0.0\n", 3, ["effects.pulse.tau_s", "0.0 s", "1e-06 .. 1 s"]),
    "wrong sign": ("[effects.pulse]\nsign = 2\n", 2, ["effects.pulse.sign", "2", "1, -1"]),
    "a sign that is a truth value": ("[effects.pulse]\nsign = true\n", 2, ["effects.pulse.sign", "True"]),
    "a fraction for a whole number": (
        "[servo]\nrate_Hz = 1000.5\n",
        2,
        ["servo.rate_Hz", "whole number in Hz"],
    ),
    "a table that is none": ("stick = 3\n", 1, ["stick", "table", "3"]),
    "effects that are none": ("effects = [1]\n", 1, ["effects", "[effects.pulse]"]),
    "a row too short": (
        "[listen]\npickups = [[0.1, 0.2]]\n",
        2,
        ["listen.pickups", "[0.1, 0.2]", "3 numbers"],
    ),
    "a row out of range": (
        "[listen]\npickups = [[0.1, 0.2, 3.0]]\n",
        2,
        ["listen.pickups", "3.0", "-1 .. 1"],
    ),
    "no rows": ("[listen]\npickups = []\n", 2, ["listen.pickups", "1 to 16 rows"]),
    "a name of two lines": ('name = "a\\nb"\n', 1, ["name", "one line of text"]),
    "a name that is a number": ("name = 3\n", 1, ["name", "one line of text"]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_mistake_is_named(case: str) -> None:
    text, line, words = REFUSED[case]
    with pytest.raises(SceneError) as refused:
        parse(text, "stage/x.toml")
    assert len(refused.value.mistakes) == 1
    message = refused.value.mistakes[0]
    assert message.startswith(f"stage/x.toml:{line}: ")
    for word in words:
        assert word in message


def test_all_mistakes_are_told_at_once() -> None:
    with pytest.raises(SceneError) as refused:
        parse("[stick]\nm_kg = 9\nz_ss_m = nan\n[effects.pulse]\ntau_s = -1\n", "x.toml")
    assert [message.split(": ")[0] for message in refused.value.mistakes] == [
        "x.toml:2",
        "x.toml:3",
        "x.toml:5",
    ]


def test_text_that_is_not_toml() -> None:
    with pytest.raises(SceneError, match=r"x\.toml: not valid TOML: .*line 2"):
        parse("[stick]\nm_kg = = 3\n", "x.toml")


def test_an_empty_text_is_the_default_without_effects() -> None:
    assert parse("", "stage/quiet.toml") == Scene("quiet")


@given(st.text())
def test_no_text_raises_anything_else(text: str) -> None:
    try:
        parse(text, "x.toml")
    except SceneError as error:
        assert error.mistakes


@pytest.mark.parametrize("name", shipped_names())
def test_shipped_scenes_come_back_through_json(name: str) -> None:
    scene = parse(shipped_text(name), name)
    assert scene.name == name
    assert scene.words
    assert from_tables(as_tables(scene)) == scene
    assert from_tables(json.loads(json.dumps(as_tables(scene)))) == scene


def test_the_same_effects_in_another_order_are_the_same_scene() -> None:
    """Or each order would be a record type of its own, with kernels of its own."""
    text = ["[effects.noise]\n", "[effects.chaos]\n", "[effects.pulse]\n"]
    one, other = parse("".join(text), "x"), parse("".join(reversed(text)), "x")
    assert list(one.effects) == list(other.effects) == [name for name in STICK_TABLES if name in one.effects]
    made = Scene("x", effects=dict(reversed(list(one.effects.items()))))
    assert law_of(made).dtype == law_of(one).dtype
    assert thrown(made, 0.0).dtype == thrown(one, 0.0).dtype
    assert list(table_of(made)) == list(table_of(one))


def test_an_unknown_shipped_scene() -> None:
    with pytest.raises(KeyError, match="no-such-scene"):
        shipped_text("no-such-scene")


def _values(table: type) -> st.SearchStrategy[dict[str, Any]]:
    # Anything a table may hold by its own declaration, limits included.
    fields: dict[str, st.SearchStrategy[Any]] = {}
    for key, quantity in quantities(table).items():
        number = st.floats(quantity.low, quantity.high, allow_nan=False)
        if quantity.choices:
            fields[key] = st.sampled_from(quantity.choices)
        elif quantity.kind is int:
            fields[key] = st.integers(int(quantity.low), int(quantity.high))
        elif quantity.kind is tuple:
            row = st.tuples(*[number] * quantity.length)
            fields[key] = st.lists(row, min_size=quantity.fewest, max_size=16).map(tuple)
        elif quantity.kind is str:
            fields[key] = st.text(max_size=int(quantity.high)).filter(str.isprintable)
        else:
            fields[key] = number
    return st.fixed_dictionaries({}, optional=fields)


TABLES: dict[str, type] = {
    **{
        f.name: f.default_factory  # type: ignore[misc]
        for f in dataclasses.fields(Scene)
        if f.name not in ("name", "words", "effects", "modal", "mallet")
    },
    "modal": Modal,
    "mallet": Mallet,
}


def _a_curve(strike: Strike, has_mallet: bool) -> Strike:
    # Numbers that the curve uses, rising; strokes where a mallet makes them, soft below hard.
    changes: dict[str, Any] = {"table": (), "softest_m_per_s": Strike().softest_m_per_s}
    if strike.curve == "table":
        speeds = sorted({speed for speed, _ in strike.table} | {1.0, 2.0})[-16:]
        changes["table"] = tuple((speed, at / 16.0) for at, speed in enumerate(speeds))
        changes["full_scale_m_per_s"] = speeds[-1]
    if strike.curve == "log":
        changes["softest_m_per_s"] = 0.1 * strike.full_scale_m_per_s
    if not (has_mallet and strike.soft_stroke_m_per_s < strike.stroke_m_per_s):
        changes |= {"stroke_m_per_s": 0.0, "soft_stroke_m_per_s": 0.0}
    return dataclasses.replace(strike, **changes)


def _in_agreement(tables: dict[str, Any]) -> dict[str, Any]:
    # What no single key declares: a recorded gesture has a file.
    hand = tables["hand"]
    if hand.gesture == "recorded":
        tables["hand"] = dataclasses.replace(hand, gesture_file=hand.gesture_file or "mine.csv")
    else:
        tables["hand"] = dataclasses.replace(hand, gesture_file="")
    # A bank of modes stands instead of a mesh, and of what needs one; a microphone has a height and a pan.
    listen = tables["listen"]
    above = tuple((x, y, max(abs(z), 0.1), pan / 50.0) for x, y, z, pan in listen.microphones)
    if tables["modal"] is not None:
        linear = {k: v for k, v in tables["drum"].effects.items() if k in MODAL_EFFECTS}
        if "kettle" in linear:
            linear = {"air": DRUM_TABLES["air"](), **linear}
        tables["drum"] = dataclasses.replace(tables["drum"], effects=linear, excitation="analytic")
    else:
        meshed = {k: v for k, v in tables["drum"].effects.items() if k in MESH_EFFECTS}
        above = () if MESH_PICKUPS_ONLY.keys() & meshed else above
        tables["drum"] = dataclasses.replace(tables["drum"], effects=meshed)
    # What is chosen by itself is not said by hand.
    mesh = tables["mesh"]
    if mesh.accuracy == "auto":
        chosen = dataclasses.replace(mesh, rate_Hz=0.0, junctions_across=0.0)
        tables["mesh"] = chosen if tables["modal"] is None else dataclasses.replace(mesh, accuracy="draft")
    # Pickups that can be moved are on the head, and microphones would be heard in their place.
    if listen.pickup_places == "live":
        on_head = tuple((0.7 * x, 0.7 * y, pan) for x, y, pan in listen.pickups)
        listen, above = dataclasses.replace(listen, pickups=on_head), ()
    tables["listen"] = dataclasses.replace(listen, microphones=above)
    # Two hands take turns with two sticks, which are heard by their strikes.
    hand = tables["hand"]
    if hand.hands == 2:
        alone = hand.gesture in ("hold", "recorded") or tables["device"].plant != "stick"
        if alone or tables["drum"].excitation == "streamed":
            tables["hand"] = dataclasses.replace(hand, hands=1)
    # A mallet is there where it strikes.
    if tables["drum"].excitation != "mallet":
        tables["mallet"] = None
    tables["strike"] = _a_curve(tables["strike"], tables["drum"].excitation == "mallet")
    # The fourth order is one scheme of one mesh.
    if tables["mesh"].accuracy == "fine":
        tables["mesh"] = dataclasses.replace(tables["mesh"], topology="triangular", courant="limit")
    # Wires lie on a second head, and neighbours shake it.
    if {"snare", "sympathy"} & tables["drum"].effects.keys():
        two_heads = {"cavity": DRUM_TABLES["cavity"](), **tables["drum"].effects}
        tables["drum"] = dataclasses.replace(tables["drum"], effects=two_heads)
    # The pitch may rise by more than it does on average.
    tension = tables["drum"].effects.get("tension")
    if tension is not None and tension.young_GPa == 0.0:
        roomy = {**tables["drum"].effects, "tension": dataclasses.replace(tension, most_cents=0.0)}
        tables["drum"] = dataclasses.replace(tables["drum"], effects=roomy)
    # And a head's own losses take more from what is higher.
    loss, drum = tables["drum"].effects.get("internal_loss"), tables["drum"]
    if loss is not None and not (loss.t60_s < drum.t60_s and loss.at_Hz > drum.f01_Hz):
        tables["drum"] = dataclasses.replace(drum, t60_s=60.0, f01_Hz=20.0)
        loss = dataclasses.replace(loss, t60_s=min(loss.t60_s, 59.0))
        tables["drum"] = dataclasses.replace(tables["drum"], effects={**drum.effects, "internal_loss": loss})
    # A second head is not far lower than the first.
    drum = tables["drum"]
    if "cavity" in drum.effects:
        second = drum.effects["cavity"]
        second = dataclasses.replace(second, f01_Hz=max(second.f01_Hz, 0.5 * drum.f01_Hz))
        tables["drum"] = dataclasses.replace(drum, effects={**drum.effects, "cavity": second})
    return tables


@given(st.data())
def test_whatever_the_declarations_allow_comes_back(data: st.DataObject) -> None:
    tables = {name: kind(**data.draw(_values(kind))) for name, kind in TABLES.items()}  # type: ignore[operator]
    if data.draw(st.booleans()):
        tables["modal"] = None
    named = data.draw(st.sets(st.sampled_from(list(STICK_TABLES))))
    effects = {
        name: STICK_TABLES[name](**data.draw(_values(STICK_TABLES[name])))
        for name in STICK_TABLES
        if name in named
    }
    if "cor_pulse" in effects and tables["stick"].r_in_N_s_per_m >= 1.99 * math.sqrt(
        tables["stick"].m_kg * tables["stick"].k_coll_N_per_m
    ):
        effects["cor_pulse"] = dataclasses.replace(
            effects["cor_pulse"], scale="speed"
        )  # (3) has no beta there
    kinds = data.draw(st.sets(st.sampled_from(list(DRUM_TABLES))))
    on_drum = {n: kind(**data.draw(_values(kind))) for n, kind in DRUM_TABLES.items() if n in kinds}
    tables["drum"] = dataclasses.replace(tables["drum"], effects=on_drum)
    scene = Scene("x", effects=effects, **_in_agreement(tables))
    assert from_tables(json.loads(json.dumps(as_tables(scene)))) == scene


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    ),
    st.sampled_from(["stick", "listen", "effects", "servo", "nonsense"]),
)
def test_tables_from_elsewhere_raise_nothing_else(table: object, name: str) -> None:
    """`from_tables` gets what came over the wire."""
    try:
        from_tables({"name": "x", name: table, "listen": {"pickups": table}})
    except SceneError as error:
        assert error.mistakes


@pytest.mark.parametrize(
    "table", [*TABLES.values(), *STICK_TABLES.values()], ids=lambda table: table.__name__
)
def test_every_default_lies_in_its_own_range(table: type) -> None:
    made = table()
    for key, quantity in quantities(table).items():
        value = getattr(made, key)
        assert quantity.words
        if quantity.choices:
            assert value in quantity.choices
        elif quantity.kind in (int, float):
            assert quantity.unit
            assert math.isfinite(value)
            assert quantity.low <= value <= quantity.high
