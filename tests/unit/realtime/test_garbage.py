"""Collection of garbage while a process makes itself ready, and afterwards."""

import gc
from pathlib import Path

import pytest

from kernel_program import answer_of
from realtime.garbage import left_lying

# In a process of its own: what is never looked through any more would be all that the tests have made.
_PROGRAM = """
import gc
import json
from realtime.garbage import importing

with importing():
    before = gc.isenabled(), gc.get_freeze_count()
    from pythonosc import dispatcher
there = gc.is_tracked(vars(dispatcher)), any(each is dispatcher for each in gc.get_objects())
print(json.dumps([*before, gc.isenabled(), gc.get_freeze_count() > 1000, *there]))
"""


def test_modules_are_never_looked_through(tmp_path: Path) -> None:
    assert answer_of(_PROGRAM, tmp_path) == [False, 0, True, True, True, False]


@left_lying()
def _broken(found: list[bool]) -> None:
    found.append(gc.isenabled())
    raise LookupError


def test_garbage_is_collected_again_after_a_fault_too() -> None:
    found: list[bool] = []
    with pytest.raises(LookupError):
        _broken(found)
    assert [*found, gc.isenabled()] == [False, True]
