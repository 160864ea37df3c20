"""A page that is used passes for ever; a flood does not."""

import itertools

import pytest

from web_panel.access.message_rate_limit import MessageRateLimit


def admitted(per_s: float, seconds: float) -> float:
    """For how long so many messages a second pass, s."""
    pace = MessageRateLimit(0.0)
    for number in itertools.count():
        if number / per_s > seconds or not pace.allows(number / per_s):
            return number / per_s
    raise AssertionError


@pytest.mark.parametrize("per_s", [20.0, 80.0, 240.0])
def test_a_page_passes_for_ever(per_s: float) -> None:
    assert admitted(per_s, 100.0) > 100.0


@pytest.mark.parametrize(("per_s", "seconds"), [(1000.0, 1.33), (10_000.0, 0.103)])
def test_a_flood_ends(per_s: float, seconds: float) -> None:
    assert admitted(per_s, 100.0) == pytest.approx(seconds, rel=0.02)


def test_what_was_saved_up_does_not_grow_without_end() -> None:
    pace = MessageRateLimit(0.0)
    assert sum(pace.allows(1e6) for _ in range(5000)) == 1000
