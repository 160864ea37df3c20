"""The conformance suite for effects passes the instrument's own, and refuses by its rule each that breaks one.

All that play are the same functions, compiled once: at events and by the clock. They break the rule that a number of
their table names.
"""

import random
from dataclasses import make_dataclass
from typing import Any

import numpy as np
import pytest

from drumstick.parameters.declare import count, number
from drumstick.stick.effects.own_effect import Effect
from drumstick.stick.effects.registry import EFFECTS
from drumstick.testing import NotConforming, check_effect
from realtime.records import Record

HONEST, TOO_STRONG, NOT_A_NUMBER, FOLLOWS, ALLOCATES, RAISES, BY_CHANCE, DRAWN_BOUND, NEVER_OFF = range(9)
RULES = {
    TOO_STRONG: "force bound",
    NOT_A_NUMBER: "finite",
    FOLLOWS: "constant force",
    ALLOCATES: "allocates nothing",
    RAISES: "raises nothing",
    BY_CHANCE: "deterministic",
    DRAWN_BOUND: "deterministic",
    NEVER_OFF: "zero strength",
}


class Drawn(Record):
    """A force that is drawn at entry."""

    force_N: float


def fire(own: Any, state: Any, when: int) -> None:
    if when == 0:
        state.force_N = own.force
        if own.breaks == BY_CHANCE:
            state.force_N = own.force * random.random()
        elif own.breaks == ALLOCATES:
            state.force_N = np.full(1 + int(own.force), own.force)[0]
        elif own.breaks == RAISES:
            raise ValueError


def renew(own: Any, state: Any, motion: Any) -> None:
    if own.breaks == HONEST:  # both at events and by the clock
        state.force_N = own.force if motion.v > 0.0 else -own.force


def force(own: Any, state: Any, motion: Any) -> float:
    if own.breaks == TOO_STRONG:
        return 1.01 * state.force_N
    if own.breaks == NOT_A_NUMBER and motion.v_in < -0.5:
        return np.nan
    if own.breaks == FOLLOWS:
        return own.force * max(-1.0, motion.z)
    return state.force_N


def max_force(own: Any) -> float:
    if own.breaks == DRAWN_BOUND:
        return own.force * (1.0 + random.random())
    return own.force


def table(breaks: int, **more: Any) -> type:
    low = 0.1 if breaks == NEVER_OFF else 0.0
    numbers = {
        "force_N": (float, number(1.0, low, 5.0, "N", "Force", wire="liar.force")),
        "breaks": (int, count(breaks, breaks, breaks, "1", "Rule that it breaks")),
    } | more
    return make_dataclass("Liar", [(name, *declared) for name, declared in numbers.items()], frozen=True)


def liar(breaks: int) -> Effect:
    return Effect(table(breaks), force, max_force, fire, renew, state=Drawn)


def test_one_that_keeps_the_rules_passes_and_is_gone_afterwards() -> None:
    check_effect("liar", liar(HONEST), scenes=30)
    assert "liar" not in EFFECTS


@pytest.mark.parametrize("breaks", RULES, ids=RULES.values())
def test_each_broken_rule_is_told_by_name(breaks: int) -> None:
    with pytest.raises(NotConforming, match=r"^liar: ") as told:
        check_effect("liar", liar(breaks), scenes=30)
    assert told.value.rule == RULES[breaks]
    assert (breaks == DRAWN_BOUND) == ("max_force" in str(told.value))


def objects(own: Any) -> float:
    return (
        float({"force": own.force}["force"])
        + len([each for each in "abc" if each.isupper()])
        + globals()["x"]
    )


def test_one_that_does_not_compile_is_refused() -> None:
    with pytest.raises(NotConforming, match=r"^liar: compiles: ") as told:
        check_effect("liar", Effect(table(HONEST), objects, max_force))
    assert "test_check_effect.py" in str(told.value)


def test_a_default_outside_its_range_is_refused() -> None:
    wide = table(HONEST, place_m=(float, number(2.0, 0.0, 1.0, "m", "Place")))
    with pytest.raises(NotConforming, match=r"^liar: range: place_m = 2.0 by itself"):
        check_effect("liar", Effect(wide, force, max_force, fire, state=Drawn))


def no_numbers() -> Effect:
    return Effect(make_dataclass("Empty", [], frozen=True), force)


def compiled_already() -> Effect:
    return Effect(table(HONEST), np.abs)  # type: ignore[arg-type]


def asks_for_more(own: Any, law: Any) -> float:
    return 0.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (no_numbers, "one number must have a wire name"),
        (compiled_already, "force is a ufunc: give a plain function"),
        (lambda: Effect(table(HONEST), asks_for_more), "force asks for `law`"),
        (lambda: Effect(table(HONEST), max_force, renew=fire, every_s=1e-9), "renew asks for `when`"),
        (lambda: Effect(table(HONEST), max_force, every_s=1e-9), "every_s = 1e-09 s: give 0.0001 s or more"),
    ],
)
def test_what_is_no_effect_says_so_where_it_is_made(make: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("pulse", "pulse is an effect of the instrument itself"),
        ("k_coll", "k_coll cannot be the name of an effect"),
        ("other", 'wire = "liar.force" must begin with the name of the effect: other.'),
    ],
)
def test_a_name_that_it_cannot_bear_is_a_mistake_of_its_declaration(name: str, words: str) -> None:
    with pytest.raises(NotConforming, match=f"^{name}: declaration: {words}"):
        check_effect(name, liar(HONEST))


def fire_and_write(own: Any, motion: Any, when: int) -> None:
    if own.breaks < 0:  # never, but it would be compiled
        motion.v = 1.0


def write_own(own: Any, state: Any) -> None:
    own.force = 1e6


@pytest.mark.parametrize("more", [{"fire": fire_and_write}, {"renew": write_own}])
def test_neither_the_stick_nor_what_the_envelope_judged_can_be_written_to(more: Any) -> None:
    with pytest.raises(NotConforming, match=r"No definition for lowering .* = float64"):
        check_effect("liar", Effect(table(HONEST), force, max_force, state=Drawn, **more))


@pytest.mark.parametrize("name", list(EFFECTS))
@pytest.mark.daily("pulse")
def test_the_instruments_own_effects_pass(name: str) -> None:
    check_effect(name)
