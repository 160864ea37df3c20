"""The compiled clock is Python's monotonic clock."""

import time
from collections.abc import Callable

import numpy as np
import pytest

from realtime.clock import now_ns, sleep_for_the_rest, sleep_until


def test_it_is_the_same_clock_as_pythons() -> None:
    buffer = np.zeros(2, np.int64)
    now_ns(buffer)
    before, ours, after = time.monotonic_ns(), now_ns(buffer), time.monotonic_ns()
    assert before <= ours <= after


@pytest.mark.parametrize("sleep_until", [sleep_until, sleep_for_the_rest])
def test_a_sleep_ends_after_its_deadline_and_a_past_one_at_once(sleep_until: Callable[..., None]) -> None:
    buffer = np.zeros(2, np.int64)
    deadline = now_ns(buffer) + 2_000_000
    sleep_until(buffer, deadline)
    assert now_ns(buffer) >= deadline
    sleep_until(buffer, 0)  # would hang for ever if it were taken for a duration from now in the future
