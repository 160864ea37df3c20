"""The picture's head: its corners, its closed mesh, and how much it is exaggerated."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.messages import Membrane
from web_panel.rig.surface_mesh import Exaggeration, disc, heights_of, hoop, tallness


def surface(rings: int, spokes: int, heights: bytes, unit_m: float = 1e-6) -> Membrane:
    return Membrane(id="s", t_ns=0, rings=rings, spokes=spokes, unit_m=unit_m, heights=heights)


def test_heights_are_whole_numbers_of_the_unit() -> None:
    given_heights = np.array([0, 100, -32767, 5], "<i2")
    assert heights_of(surface(1, 3, given_heights.tobytes())) == pytest.approx(1e-6 * given_heights)


@given(st.integers(-3, 100_000), st.integers(-3, 100_000), st.binary(max_size=64), st.floats(allow_nan=False))
def test_what_is_no_surface_is_a_value_error(rings: int, spokes: int, heights: bytes, unit_m: float) -> None:
    try:
        found = heights_of(surface(rings, spokes, heights, unit_m))
    except ValueError:
        return
    assert len(found) == 1 + rings * spokes
    assert np.abs(found).max() <= 10.0


def area(corners: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (corners[faces[:, i]] for i in range(3))
    return float(np.cross(b - a, c - a)[:, 2].sum() / 2.0)


def test_the_head_is_whole_and_faces_up() -> None:
    corners, faces = disc(16, 48)
    assert corners.shape == (1 + 17 * 48, 3)
    assert set(faces.ravel().tolist()) == set(range(len(corners)))
    # A polygon of 48 corners; were a triangle missing, doubled or upside down, the sum would tell.
    assert area(corners, faces) == pytest.approx(24.0 * math.sin(2.0 * math.pi / 48.0), rel=1e-6)
    assert np.hypot(corners[-48:, 0], corners[-48:, 1]) == pytest.approx(np.ones(48), abs=1e-6)


def test_the_hoop_is_open_above_the_head() -> None:
    corners, faces = hoop(1.0, 1.07, -0.09, 0.0)
    assert np.hypot(corners[:, 0], corners[:, 1]).min() > 0.999
    assert faces.max() < len(corners)


def test_where_the_stick_pushes_does_not_count() -> None:
    heights = np.full(769, 1e-4)
    heights[0] = 5e-3
    assert tallness(heights) == pytest.approx(1e-4)


def test_the_exaggeration_is_a_round_number_that_fits_and_seldom_changes() -> None:
    factor = Exaggeration()
    assert factor.of(1e-4, 0.16, 0.0) == 200.0
    assert factor.of(0.8e-4, 0.16, 1.0) == 200.0  # softer: looks softer
    assert factor.of(1e-3, 0.16, 2.0) == 20.0  # would not fit
    assert factor.of(1e-4, 0.16, 5.0) == 20.0  # the loud one is not long ago
    assert factor.of(1e-4, 0.16, 13.0) == 200.0
    assert factor.of(0.0, 0.16, 99.0) == 200.0  # nothing moves: nothing to learn
