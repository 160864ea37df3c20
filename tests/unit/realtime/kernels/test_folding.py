"""One kernel out of many parts: which parts take part, in which order, and with which arguments."""

from types import ModuleType, SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from realtime.kernels import store
from realtime.kernels.folding import (
    added,
    all_of,
    any_of,
    each,
    folded,
    largest,
    least,
    listed,
    multiplied,
    present,
    single,
    sizes_added,
)
from realtime.kernels.jit import njit, only_with


@only_with("a")
def _a_note(record: Any, log: Any) -> None:
    log[0] = 10.0 * log[0] + 1.0


@only_with("b")
def _b_note(record: Any, log: Any, weight: float) -> None:
    log[0] = 10.0 * log[0] + weight


@only_with("a", otherwise=0.0)
def _a_value(record: Any) -> float:
    return record.a.value


@only_with("b", otherwise=0.0)
def _b_value(record: Any) -> float:
    return record.b.value


@only_with("b", otherwise=0.0)
def _b_own(record: Any, item: float) -> float:
    return item


@only_with("b", otherwise=0.0)
def _astray(record: Any, nonsense: float) -> float:
    return nonsense


@pytest.fixture(autouse=True)
def unkept(monkeypatch: pytest.MonkeyPatch) -> None:
    """The store knows a kernel inside a test by its name alone."""
    monkeypatch.setattr(store, "ROOT", None)


def part(**functions: Any) -> ModuleType:
    return cast(ModuleType, SimpleNamespace(**functions))


PARTS = {
    "a": part(note=_a_note, value=_a_value, own=_b_own),
    "b": part(note=_b_note, value=_b_value, own=_b_own, astray=_astray),
    "c": part(),
}


@folded(PARTS, each)
def note(record: Any, weight: float, log: Any) -> None:
    """Nothing."""


def _of(fold: Any, neutral: float) -> Any:
    @folded(PARTS, fold, hook="value")
    def total(record: Any) -> float:
        return neutral

    return total


TOTALS = {
    "added": (_of(added, 0.5), 0.5, -5.0, -2.0),
    "sizes_added": (_of(sizes_added, 0.5), 0.5, 5.0, 8.0),
    "multiplied": (_of(multiplied, 0.5), 0.5, -5.0, -15.0),
    "least": (_of(least, 0.5), 0.5, -5.0, -5.0),
    "largest": (_of(largest, 0.5), 0.5, -5.0, 3.0),
}


def record(**values: float) -> Any:
    kinds: list[Any] = [(name, [("value", "f8")]) for name in values]
    made = np.zeros(1, np.dtype([*kinds, ("other", "f8")], align=True))
    for name, value in values.items():
        made[name]["value"] = value
    return made[0]


@pytest.mark.parametrize("name", TOTALS)
def test_a_record_without_any_part_gives_the_bodys_own_value(name: str) -> None:
    total, nothing, one, both = TOTALS[name]

    @njit()
    def played(record: Any) -> float:
        return total(record)

    assert played(record()) == nothing
    assert played(record(a=-5.0)) == one
    assert played(record(c=9.0, a=-5.0)) == one, "a part without the function takes no part"
    assert played(record(a=-5.0, b=3.0)) == both


@pytest.mark.parametrize(("fold", "both"), [(any_of, True), (all_of, False)])
def test_one_that_says_yes_is_enough_for_any_and_not_for_all(fold: Any, both: bool) -> None:
    @folded(PARTS, fold, hook="value")
    def answer(record: Any) -> bool:
        return False

    @njit()
    def asked(record: Any) -> bool:
        return bool(answer(record))

    assert asked(record(a=0.0, b=3.0)) is both
    assert not asked(record())


def test_the_order_is_the_registrys_and_each_gets_what_it_asks_for() -> None:
    @njit()
    def noted(record: Any, log: Any) -> None:
        note(record, 7.0, log)

    for given, expected in ((record(), 0.0), (record(b=0.0), 7.0), (record(b=0.0, a=0.0), 17.0)):
        log = np.zeros(1)
        noted(given, log)
        assert log[0] == expected


def test_each_part_gets_its_own_item_of_a_tuple() -> None:
    @folded({"a": part(own=_a_item), "b": part(own=_b_own)}, listed, own={"item": "items"})
    def own(record: Any, items: Any) -> Any:
        return ()

    @njit()
    def shared_out(record: Any) -> Any:
        return own(record, (1.0, 2.0))

    assert shared_out(record(a=0.0, b=0.0)) == (1.0, 2.0)
    assert shared_out(record(b=0.0)) == (1.0,)


@only_with("a", otherwise=0.0)
def _a_item(record: Any, item: float) -> float:
    return item


def test_a_part_that_asks_for_what_there_is_not_is_named() -> None:
    @folded(PARTS, added)
    def astray(record: Any) -> float:
        return 0.0

    @njit()
    def played(record: Any) -> float:
        return astray(record)

    assert played(record(a=1.0)) == 0.0
    with pytest.raises(TypeError, match="_astray asks for `nonsense`; there are: record"):
        played(record(b=1.0))


def test_it_is_for_compiled_code() -> None:
    with pytest.raises(TypeError, match="for compiled code"):
        note(record(), 1.0, np.zeros(1))


def test_whether_one_is_there_is_known_without_asking_it() -> None:
    @folded(PARTS, present, hook="note")
    def has_note(record: Any, weight: float, log: Any) -> bool:
        return False

    @njit()
    def asked(record: Any, log: Any) -> bool:
        return bool(has_note(record, 7.0, log))

    log = np.zeros(1)
    assert not asked(record(), log)
    assert asked(record(b=0.0), log)
    assert log[0] == 0.0


def test_of_what_there_can_be_one_only_a_second_is_refused_in_words() -> None:
    @folded(PARTS, single, hook="value")
    def one(record: Any) -> Any:
        return None

    @njit()
    def played(record: Any) -> Any:
        return one(record)

    assert played(record()) is None
    assert played(record(b=3.0)) == 3.0
    with pytest.raises(Exception, match=r"only one part may have this: a_value\(record\), b_value\(record\)"):
        played(record(a=1.0, b=3.0))
