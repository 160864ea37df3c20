"""A stored result of another guard is told as out of date, not as today's."""

from typing import Any

import pytest

from drumstick_lab.guard_version import guard_version
from drumstick_lab.pages.measured import servo_region

SEARCH = {
    "sets": 1000, "within_2_percent_of_the_boundary": 500, "unsafe": [], "worst_late_m_per_s": 0.001,
    "worst_late_entry_m_per_s": 0.001, "date": "2026-11-24",
}  # fmt: skip


@pytest.mark.parametrize(
    ("made_with", "is_old"), [({"guard": guard_version()}, False), ({"guard": "0" * 16}, True), ({}, True)]
)
def test_the_page_says_with_which_guard_the_search_was_made(made_with: dict[str, Any], is_old: bool) -> None:
    held = {"search": {**SEARCH, **made_with}, "known": [], **made_with}
    words = "\n".join(servo_region._search(held))
    assert ("Out of date" in words) == is_old
    assert ("2026-11-24" in words) == is_old
    held["known"] = [{"case": "no delay", "refused": "", "guard_alone": None}]
    assert ("today's guard does" not in "\n".join(servo_region._known(held))) == is_old
