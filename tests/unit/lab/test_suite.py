"""Figures that `drumstick lab suite` reads out of the words of `make test`."""

from drumstick_lab.benchmarks.robustness.suite import is_green, read_output

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


def test_a_pass_in_which_nothing_passed_keeps_its_place() -> None:
    read = read_output(GREEN.replace("5399 passed, 12 deselected", "1 error"), 400.0)
    assert read["seconds"]["computing"] == 130.5
    assert read["tests"] == {"computing": 0, "processes": 184, "real clock": 88}


def test_a_case_is_named_whole() -> None:
    read = read_output("FAILED tests/unit/test_a.py::test_it[a drum - soft] - assert ['x'] == []", 1.0)
    assert read["failed"] == ["tests/unit/test_a.py::test_it[a drum - soft]"]


def test_a_run_is_green_when_every_step_was() -> None:
    went_on = "make: [Makefile:36: test] Error 1 (ignored)\n"
    assert is_green(0, GREEN, "a warning (ignored)\n")
    assert not is_green(0, GREEN, went_on)
    assert not is_green(2, GREEN, "")
    assert not is_green(
        0,
        "FAILED tests/unit/test_a.py::test_it - assert 0",
        "make: [Makefile:36: test] Fehler 1 (ignoriert)\n",
    )
