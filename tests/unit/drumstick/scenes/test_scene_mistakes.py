"""Every quantity of every table, one mistake at a time: file, line, key, value, limit and unit are named."""

import dataclasses
import math

import pytest

from drumstick.drum.effects.registry import DRUM_TABLES
from drumstick.parameters.declare import Quantity, quantities
from drumstick.parameters.drum import Modal
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Geometry
from drumstick.scenes.line_numbers import lines_of
from drumstick.scenes.scene_text import SceneError, as_tables, from_tables, parse
from drumstick.scenes.stick_tables import Z_H0
from drumstick.stick.effects.registry import STICK_TABLES

TABLES: dict[str, type] = {
    **{
        field.name: field.default_factory  # type: ignore[misc]
        for field in dataclasses.fields(Scene)
        if field.name not in ("name", "words", "effects", "modal", "mallet")
    },
    "modal": Modal,
    "mallet": Mallet,
    "stick.geometry": Geometry,
    **{f"effects.{name}": kind for name, kind in STICK_TABLES.items()},
    **{f"drum.effects.{name}": kind for name, kind in DRUM_TABLES.items()},
}
# A table whose keys must all be there: what the others are while one is wrong.
LEVER = {"inertia_kg_m2": 4e-4, "mass_kg": 0.055, "grip_m": 0.08, "tip_m": 0.4, "com_m": 0.18}
# Before each mistake: words that look like tables and keys, in strings and comments, and some good lines.
BEFORE = """# [stick]
name = "a [stick] = 3"  # m_kg = 3
words = 'dv_m_per_s = "7"'

"""
SOURCE = "stage/a.toml"


def _keys() -> list[tuple[str, str, Quantity]]:
    rows = [
        (path, key, quantity) for path, kind in TABLES.items() for key, quantity in quantities(kind).items()
    ]
    return [*rows, ("stick", "z_h0_m", Z_H0)]


EVERY_KEY = pytest.mark.parametrize(
    ("path", "key", "quantity"), _keys(), ids=lambda v: v if isinstance(v, str) else ""
)


def _mistake(path: str, key: str, value: str) -> str:
    # The only mistake of a scene that has this one, behind file, line and key.
    good = {other: number for other, number in LEVER.items() if path == "stick.geometry" and other != key}
    needed = {
        "drum.effects.snare": ["[drum.effects.cavity]"],
        "drum.effects.sympathy": ["[drum.effects.cavity]"],
        "drum.effects.air": ["[modal]"],
        "drum.effects.kettle": ["[modal]", "[drum.effects.air]"],
    }.get(path, [])
    needed += ["[drum]", 'excitation = "mallet"'] if path == "mallet" else []
    given = [f"[{path}]", *(f"{k} = {v}" for k, v in good.items()), f"{key} = {value}"]
    lines = [*BEFORE.splitlines(), *needed, *given]
    with pytest.raises(SceneError) as refused:
        parse("\n".join(lines) + "\n", SOURCE)
    # An unknown key may stand in the place of one that the table needs; that is told on another line.
    named = [mistake for mistake in refused.value.mistakes if "missing: " not in mistake]
    assert len(named) == 1
    place = f"{SOURCE}:{len(lines)}: {path}.{key}: "
    assert named[0].startswith(place)
    return named[0].removeprefix(place)


def _is_text(quantity: Quantity) -> bool:
    return quantity.kind is str and not quantity.choices


def _holds(words: str, quantity: Quantity, value: str) -> None:
    assert value in words
    for choice in quantity.choices:
        assert repr(choice) in words
    if _is_text(quantity):
        assert f"at most {quantity.high:g} characters" in words
    elif not quantity.choices:
        assert f"{quantity.low:g} .. {quantity.high:g} {quantity.unit}" in words


def _written(quantity: Quantity, number: float) -> str:
    text = str(int(number)) if quantity.kind is int else repr(number)
    return f"[[{', '.join(['0.0'] * (quantity.length - 1) + [text])}]]" if quantity.kind is tuple else text


@EVERY_KEY
def test_a_value_out_of_range(path: str, key: str, quantity: Quantity) -> None:
    if quantity.choices:
        for other in ("'never'", "7", "''"):
            _holds(_mistake(path, key, other), quantity, other)
        return
    if _is_text(quantity):
        return  # no number is a text: see below
    beyond = 1 if quantity.kind is int else 1e-3 * (quantity.high - quantity.low)
    for number in (quantity.low - beyond, quantity.high + beyond):
        shown = str(int(number)) if quantity.kind is int else repr(number)
        _holds(_mistake(path, key, _written(quantity, number)), quantity, f"{shown} {quantity.unit}")


@EVERY_KEY
def test_what_is_not_a_number(path: str, key: str, quantity: Quantity) -> None:
    for number in (math.nan, math.inf, -math.inf):
        text = _written(
            dataclasses.replace(quantity, kind=quantity.kind if quantity.length else float), number
        )
        _holds(_mistake(path, key, text), quantity, repr(number))


@EVERY_KEY
def test_a_value_of_another_type(path: str, key: str, quantity: Quantity) -> None:
    for text, shown in {"true": "True", "'2 ms'": "'2 ms'", "[1.5]": "[1.5]", "1979-05-27": "1979"}.items():
        if _is_text(quantity) and text.startswith("'"):
            text, shown = f"'{'x' * 201}'", "xxx"
        words = _mistake(path, key, text)
        if quantity.kind is tuple:
            assert f"{quantity.length} numbers" in words
        else:
            _holds(words, quantity, shown)
    if quantity.kind is int:
        _holds(_mistake(path, key, "1.5"), quantity, "1.5")


@EVERY_KEY
def test_a_key_in_another_unit(path: str, key: str, quantity: Quantity) -> None:
    """Or with a letter too many: the known key is named, with its limits and unit."""
    if key == "z_h0_m":
        return  # another view of z_ss_m, beside the declared ones
    wrong = f"{key}m"
    words = _mistake(path, wrong, "123.5")
    assert words.startswith("unknown key, given 123.5; did you mean ")
    _holds(words, quantity, f"did you mean {key}, ")


@pytest.mark.parametrize("path", TABLES)
def test_a_table_that_is_none(path: str) -> None:
    name, _, last = path.rpartition(".")
    text = f"# one\n{f'[{name}]' if name else ''}\n{last} = 3.5\n"
    with pytest.raises(SceneError) as refused:
        parse(text, SOURCE)
    assert refused.value.mistakes[0] == f"{SOURCE}:3: {path}: must be a table, not 3.5"


FORMS = {
    "in braces": ("\n\nstick = { m_kg = 9 }\n", 3),
    "in braces within braces": ("\neffects = { pulse = { tau_s = 9.0 } }\n", 2),
    "dotted": ("\neffects.pulse.tau_s = 9.0\n", 2),
    "dotted, with spaces": ("[effects]\n\npulse . tau_s=9.0\n", 3),
    "in quotes": ('[effects."pulse"]\n\n"tau_s" = 9.0\n', 3),
    "in quotes, escaped": ("[effects]\n[effects . 'pulse']\n\n\"tau\\u005fs\" = 9.0\n", 4),
    "an unknown word of another script": ('[stick]\nm_kg = 0.1\n"масса" = 9.0\n', 3),
    "with the line ends of Windows": ("[stick]\r\n\r\nm_kg = 9.0\r\n", 3),
    "after a list of many lines": (
        "[listen]\npickups = [\n  [0, 0, 0], # ]\n  [1, 1, 1],\n]\ngain_dB = 99.0\n",
        6,
    ),
    "a header with a comment": ("[stick] # the [stick]\nm_kg = 9.0 # m_kg = 0.1\n", 2),
    "without an end of line": ("[stick]\nm_kg = 9.0", 2),
    "a list of tables": ("\n[[stick]]\nm_kg = 0.1\n", 2),
}


@pytest.mark.parametrize("form", FORMS)
def test_the_line_however_it_is_written(form: str) -> None:
    text, line = FORMS[form]
    with pytest.raises(SceneError) as refused:
        parse(text, SOURCE)
    assert [m.split(": ")[0] for m in refused.value.mistakes] == [f"{SOURCE}:{line}"]


def test_strings_of_many_lines_hold_no_keys() -> None:
    text = 'words = """\n[guard]\nm_kg = 1\\""""\nname = \'\'\'\n[servo]\n\'\'\'\n[stick]\nm_kg = 9\n'
    assert lines_of(text) == {"words": 1, "name": 4, "stick": 7, "stick.m_kg": 8}


@pytest.mark.parametrize(
    "value",
    ["9" * 400, "9" * 5000, "0x" + "f" * 5000, "[" * 5000 + "]" * 5000, "{a=" * 500 + "1" + "}" * 500],
)
def test_monstrous_values_are_mistakes_too(value: str) -> None:
    with pytest.raises(SceneError) as refused:
        parse(f"[stick]\nm_kg = {value}\n", SOURCE)
    assert refused.value.mistakes[0].startswith(SOURCE)
    assert len(refused.value.mistakes[0]) < 400


def test_modal_stands_instead_of_a_mesh_and_of_what_needs_one() -> None:
    with pytest.raises(SceneError) as refused:
        parse("[modal]\n[mesh]\n[drum.effects.cavity]\n[drum.effects.rim]\n", SOURCE)
    assert sorted(refused.value.mistakes) == [
        f"{SOURCE}:1: modal: stands instead of [mesh]: a scene has one of them",
        f"{SOURCE}:3: drum.effects.cavity: needs [mesh]: a bank of modes has no junctions for it",
    ]
    assert parse("[drum.effects.rim]\n", SOURCE).modal is None
    kept = parse("[modal]\ntop_Hz = 5000\n[drum.effects.rim]\n", SOURCE)
    assert kept.modal == Modal(top_Hz=5000.0)
    assert from_tables(as_tables(kept)) == kept
