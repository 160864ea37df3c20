"""Cycles of the shipped scenes are those that were found once, to twelve digits: nothing moved them unseen."""

import json

import pytest

from stored_cycles import FILE, cycles_of, names

STORED: dict[str, list[list[float]]] = json.loads(FILE.read_text(encoding="utf-8"))


def test_each_shipped_scene_of_one_hand_is_in_the_table() -> None:
    assert list(STORED) == names()


@pytest.mark.long
@pytest.mark.parametrize("name", names())
def test_a_shipped_scene_has_the_cycles_that_are_stored(name: str) -> None:
    found = cycles_of(name)
    assert len(found) == len(STORED[name])
    for cycle, stored in zip(found, STORED[name], strict=True):
        assert cycle == pytest.approx(stored, rel=1e-12)
