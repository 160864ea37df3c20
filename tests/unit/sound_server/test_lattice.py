import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sound_server.excitation import nearest
from sound_server.lattice import LANES, Lattice, drawn_in, lattice_of, spacing_for, surrounding

SPACINGS = st.floats(0.02, 0.4)
PLACES = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))


def position(lattice: Lattice, flat: int) -> tuple[float, float]:
    return lattice.position(*divmod(flat, lattice.weights.shape[1]))


@given(SPACINGS)
def test_rows_are_padded_to_lanes_and_what_is_outside_has_no_weight(spacing: float) -> None:
    lattice = lattice_of(spacing)
    rows, stride = lattice.weights.shape
    assert stride % LANES == 0
    assert not lattice.spans[[0, -1]].any()
    assert not lattice.weights[:, -1].any()  # the left neighbour of the next row's first lane
    for row in range(rows):
        first, count = lattice.spans[row]
        assert first % LANES == 0
        assert count % LANES == 0
        assert first + count <= stride
        inside = np.flatnonzero(lattice.weights[row])
        assert all(first <= column < first + count for column in inside)
        assert all(math.hypot(*lattice.position(row, column)) < 1.0 for column in inside)


@given(SPACINGS)
def test_weights_are_a_sixth_inside_and_less_at_the_rim(spacing: float) -> None:
    lattice = lattice_of(spacing)
    for row, column in zip(*np.nonzero(lattice.weights), strict=True):
        weight = lattice.weights[row, column]
        if math.hypot(*lattice.position(row, column)) + spacing < 1.0 - 1e-12:
            assert weight == pytest.approx(1 / 6)
        else:
            assert 0.0 < weight <= 1 / 6 + 1e-12


def test_a_junction_beside_the_rim_by_hand() -> None:
    """Spacing 0.4: the junction at (0.8, 0) has two neighbours inside and four cut edges."""
    lattice = lattice_of(0.4)
    straight = 0.5  # from 0.8 to 1.0 along an edge of 0.4
    # |(0.8, 0) + s (cos 60, sin 60)| = 1: s^2 + 0.8 s - 0.36 = 0
    slanted = (-0.4 + math.sqrt(0.16 + 0.36)) / 0.4
    # At 120 degrees lies (0.6, 0.346), inside.
    expected = 1.0 / (3 + 1 / straight + 2 / slanted)
    assert lattice.weights[lattice.centre_row, lattice.centre_column + 2] == pytest.approx(expected)


@given(SPACINGS, PLACES)
def test_the_nearest_junction_is_inside_and_none_is_nearer(
    spacing: float, place: tuple[float, float]
) -> None:
    lattice = lattice_of(spacing)
    stride = lattice.weights.shape[1]
    found = nearest(*place, spacing, lattice.centre_row, lattice.centre_column, stride)
    assert lattice.weights.ravel()[found] > 0.0
    x, y = drawn_in(*place, 1.0 - spacing)
    distances = [
        math.dist((x, y), lattice.position(r, c)) for r, c in zip(*np.nonzero(lattice.weights), strict=True)
    ]
    assert math.dist((x, y), position(lattice, found)) <= min(distances) + 1e-9


@given(SPACINGS, PLACES)
def test_three_junctions_surround_a_pickup(spacing: float, place: tuple[float, float]) -> None:
    lattice = lattice_of(spacing)
    corners = surrounding(lattice, *place)
    assert sum(share for _, share in corners) == pytest.approx(1.0)
    assert all(share >= -1e-9 for _, share in corners)
    x = sum(share * position(lattice, flat)[0] for flat, share in corners)
    y = sum(share * position(lattice, flat)[1] for flat, share in corners)
    assert (x, y) == pytest.approx(drawn_in(*place, 1.0 - spacing), abs=1e-9)


def test_spacing_follows_the_pitch() -> None:
    # MESH rate / f01 = 1.6 junctions across, at tau = 8/3.
    assert 2.0 / spacing_for(150.0, 16000.0) == pytest.approx(0.625 * 16000.0 / 150.0, rel=1e-3)


@pytest.mark.parametrize("spacing", [0.0, 1e-4, 0.6, math.nan])
def test_no_drum_of_three_junctions(spacing: float) -> None:
    with pytest.raises(ValueError, match="the mesh takes"):
        lattice_of(spacing)
