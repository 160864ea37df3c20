"""A scene without an effect has neither its code nor its memory: the compiled text and the record types say so."""

import functools
import re

import numpy as np
import pytest

from any_scene import COMBINATIONS
from drumstick.stick.effects import random_numbers
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick.stick.law import law_type, motion_type
from drumstick.stick.motion import exact
from machine_code import Compiled

PACKAGE = "drumstick.stick.effects."
SHARED = {"decaying_pulse", "random_numbers"}  # what both pulses are made of, and noise
PULSES = {"pulse", "cor_pulse"}
# What adds pulses up: chosen by how many the scene has, another text for none.
SUMS_OF_PULSES = (
    "drumstick.stick.segment.",
    "drumstick.stick.motion.spans._first_node_for_each.",
    "drumstick.stick.motion.spans._fading",
    "drumstick.stick.motion.spans._faded",
    "drumstick.stick.motion.spans._zero_or_end",
    "drumstick.stick.motion.spans._cut_for_each.",
    "numba.cpython.numbers.int_power_impl.",  # of the pulse's derivatives
)


@functools.cache
def _text(names: tuple[str, ...]) -> Compiled:
    law, motion = np.zeros(1, law_type(names)), np.zeros(1, motion_type(names))
    return Compiled(exact.advance, law[0], motion[0], 1.0)


def _effects_in(names: tuple[str, ...]) -> set[str]:
    return {
        name.removeprefix(PACKAGE).partition(".")[0]
        for name in _text(names).linked()
        if name.startswith(PACKAGE)
    }


@pytest.mark.parametrize("names", COMBINATIONS.values(), ids=COMBINATIONS)
@pytest.mark.daily("none", "all")
def test_the_compiled_text_holds_the_named_effects_and_no_other(names: tuple[str, ...]) -> None:
    """Every effect is in one of these texts and missing from another, so a name that numba spells anew would show."""
    assert _effects_in(names) - SHARED == set(names)
    assert ("decaying_pulse" in _effects_in(names)) == bool(PULSES & set(names))


@pytest.mark.parametrize("names", COMBINATIONS.values(), ids=COMBINATIONS)
@pytest.mark.daily("none", "all")
def test_nothing_stands_in_for_an_absent_effect(names: tuple[str, ...]) -> None:
    """All are folded, so nobody asks for one by its name: not even a constant is linked."""
    linked, text = _text(names).linked(), _text(names).ir
    for effect in set(STICK_TABLES) - set(names):
        assert not [name for name in linked if f"{PACKAGE}{effect}." in name]
    assert not re.findall(r"^(?:define|declare)\b.*absent", text, re.MULTILINE)
    assert not re.findall(r"\bcall\b.*absent", text)


@pytest.mark.parametrize("names", COMBINATIONS.values(), ids=COMBINATIONS)
@pytest.mark.daily("none", "all")
def test_a_scene_adds_to_the_bare_text_its_effects_alone(names: tuple[str, ...]) -> None:
    added = _text(names).linked() - _text(()).linked()
    own = {name for name in added if name.startswith(PACKAGE)}
    sums = {name for name in added if name.startswith(SUMS_OF_PULSES)}
    folds = {name for name in added if name.startswith("drumstick.stick.composition.")}
    equation_3 = {name for name in added if name.startswith("drumstick.stick.contact.beta_eq3")}
    assert not added - own - sums - folds - equation_3
    assert bool(equation_3) == ("cor_pulse" in names)  # its gamma may be over beta
    absent = set(STICK_TABLES) - set(names)
    assert not [name for name in folds for effect in absent if re.search(rf"\.{effect}_(?!pulse_)", name)]
    assert all(any(f".{effect}_" in name for name in folds) for effect in names)
    assert bool(sums) == bool(PULSES & set(names))


@pytest.mark.parametrize("names", COMBINATIONS.values(), ids=COMBINATIONS)
@pytest.mark.daily("none", "all")
def test_the_text_itself_tells_noise_from_no_noise(names: tuple[str, ...]) -> None:
    """Beside numba's names: the multiplier of its random numbers is in the text just where the effect is named."""
    step = int(np.int64(np.uint64(random_numbers._STEP)))  # pyright: ignore[reportPrivateUsage]  LLVM writes numbers with their sign
    assert (str(step) in _text(names).ir) == ("noise" in names)


def _fields(record: np.dtype[np.void]) -> set[str]:
    return set(record.names or ())


@pytest.mark.parametrize("effect", STICK_TABLES)
def test_the_records_have_the_named_effects_fields_and_no_other(effect: str) -> None:
    without, alone = tuple(name for name in STICK_TABLES if name != effect), (effect,)
    for kind in (law_type, motion_type):
        assert _fields(kind(alone)) - _fields(kind(())) == {effect}
        assert _fields(kind(tuple(STICK_TABLES))) - _fields(kind(without)) == {effect}
        own = kind(alone)[effect].itemsize
        assert kind(alone).itemsize - kind(()).itemsize == own > 0
        assert kind(tuple(STICK_TABLES)).itemsize - kind(without).itemsize == own
