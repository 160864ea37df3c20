"""Figures that `drumstick lab suite` reads out of the words of `make test`."""

from drumstick_lab.benchmarks.robustness.suite import read_output

GREEN = """
.venv/bin/ruff check
========= 5399 passed, 12 deselected in 130.50s (0:02:10) =========
================== 184 passed, 105 deselected, 1 rerun in 150.00s ==================
=============== 88 passed, 5711 deselected in 61.24s (0:01:01) ===============
"""


def test_what_is_no_pass_is_checking() -> None:
    read = read_output(GREEN, 400.0)
    assert read["seconds"] == {"checks": 58.3, "computing": 130.5, "processes": 150.0, "real clock": 61.24}
    assert read["tests"] == {"computing": 5399, "processes": 184, "real clock": 88}
    assert (read["failed"], read["reruns"]) == ([], 1)


def test_what_failed_is_named_and_what_was_not_reached_is_missing() -> None:
    red = """
FAILED tests/unit/test_a.py::test_it[x] - assert 0
ERROR tests/unit/test_b.py::test_it - KeyError
============ 1 failed, 5398 passed, 1 error in 131.00s (0:02:11) ============
"""
    read = read_output(red, 200.0)
    assert read["failed"] == ["tests/unit/test_a.py::test_it[x]", "tests/unit/test_b.py::test_it"]
    assert read["seconds"] == {"checks": 69.0, "computing": 131.0}
