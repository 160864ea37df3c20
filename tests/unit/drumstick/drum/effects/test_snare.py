"""A bead and the head under it: the one solution of their meeting, and what it keeps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from drumstick.drum.effects.snare import met

NUMBERS = st.floats(-10.0, 10.0)


def touching(before: float, after: float) -> float:
    """2/K times the discrete gradient of K/2 [eta]+^2, from its definition."""
    if after == before:
        return 2.0 * max(after, 0.0)
    return (max(after, 0.0) ** 2 - max(before, 0.0) ** 2) / (after - before)


@given(NUMBERS, NUMBERS, st.floats(1e-3, 1e3))
def test_the_meeting_solves_its_equation(before: float, free: float, give: float) -> None:
    def wrong(after: float) -> float:
        return after - free + give * touching(before, after)

    after = met(before, free, give)
    size = abs(before) + abs(free) + 1e-3
    assert abs(wrong(after)) <= 1e-9 * size * (1.0 + give)
    far = (1.0 + give) * 20.0 * size
    assert after == pytest.approx(brentq(wrong, -far, far, xtol=1e-12 * size), abs=1e-7 * size)


@given(NUMBERS, NUMBERS, st.floats(1e-3, 1e3))
def test_a_push_gives_back_what_it_stored_and_no_more(before: float, free: float, give: float) -> None:
    """Work over the way from eta- to eta+ is the change of K/2 [eta]+^2, to rounding."""
    after = met(before, free, give)
    push = (free - after) / give
    stored = max(after, 0.0) ** 2 - max(before, 0.0) ** 2
    assert push * (after - before) == pytest.approx(stored, abs=1e-7 * (1.0 + before**2 + free**2))
    assert push >= -1e-9 * (1e-3 + abs(before) + abs(free)), "wires push, they never pull"


def test_apart_stays_apart() -> None:
    assert met(-1.0, -0.5, 3.0) == -0.5
    assert np.isfinite(met(0.0, 0.0, 1.0))
