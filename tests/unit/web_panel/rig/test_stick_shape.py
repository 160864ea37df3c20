"""The stick of the pictures: of true size, whole, and held where the hand is."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from web_panel.rig.stick_shape import grip_of, height_of, stick_shape

RADIUS_M = 0.16
places = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.5, 3.0))


def test_it_is_one_piece_of_a_sticks_length() -> None:
    shape = stick_shape(RADIUS_M)
    parts = (shape.tip, shape.shaft, shape.grip, shape.butt)
    for before, after in pairwise(parts):
        assert before[-1] == after[0]
    rows = [row for part in parts for row in part]
    assert [along for along, _ in rows] == sorted(along for along, _ in rows)
    assert rows[0] == (0.0, 0.0)
    assert rows[-1] == pytest.approx((0.407 / RADIUS_M, 0.0))
    assert all(thick >= 0.0 for _, thick in rows)
    assert max(thick for _, thick in shape.tip) == pytest.approx(shape.bead)


@given(places, st.floats(-1.0, 1.0))
def test_the_grip_is_where_the_stick_has_it(tip: tuple[float, float, float], z_h0_m: float) -> None:
    grip = grip_of(tip, z_h0_m, RADIUS_M)
    assert grip[0] > tip[0]
    assert grip[1] < tip[1]
    place, (w, x, y, z) = stick_shape(RADIUS_M).pose(tip, grip)
    assert math.hypot(w, x, y, z) == pytest.approx(1.0)
    # +z turned by the quaternion, from the stick's end: on the line from bead to grip.
    aim = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
    apart = math.dist(tip, grip)
    assert aim == pytest.approx([(b - a) / apart for a, b in zip(tip, grip, strict=True)])
    bead = (tip[0], tip[1], tip[2] + stick_shape(RADIUS_M).bead)
    assert math.dist(place, bead) == pytest.approx(0.008 / RADIUS_M)


def test_the_hand_stands_still_while_the_wrist_plays_and_rises_with_a_high_stick() -> None:
    heights = [
        grip_of((0.0, 0.0, height_of(z_m, RADIUS_M)), 0.0, RADIUS_M)[2] for z_m in (-0.002, 0.0, 0.05, 0.3)
    ]
    assert heights[0] == heights[1] == heights[2]
    assert heights[3] - heights[2] == pytest.approx(0.24 / RADIUS_M)
    assert height_of(99.0, RADIUS_M) == 3.0
    assert height_of(-99.0, RADIUS_M) == -0.5
