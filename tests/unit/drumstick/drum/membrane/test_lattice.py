import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.drum.membrane.heads import head_of
from drumstick.drum.membrane.interpolation import corners_of, drawn_in
from drumstick.drum.membrane.lattice import (
    MESH_LANES,
    STRIP_ROWS,
    TOPOLOGIES,
    Lattice,
    Topology,
    lattice_of,
    lowest_eigenvalue,
    strips_of,
)
from drumstick.drum.membrane.scheme import J01, even_losses, scheme_of, tuned

SPACINGS = st.floats(0.02, 0.4)
PLACES = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
KINDS = st.sampled_from(list(TOPOLOGIES.values()))


def position(lattice: Lattice, flat: int) -> tuple[float, float]:
    return lattice.position(*divmod(flat, lattice.weights.shape[1]))


def corners(lattice: Lattice, place: tuple[float, float]) -> list[tuple[int, float]]:
    return list(zip(*corners_of(head_of(lattice, 1.0), *place), strict=True))


def limit(lattice: Lattice) -> float:
    return 1.0 - lattice.spacing if lattice.topology.shifted else 1.0 - 1.5 * lattice.spacing


@given(SPACINGS, KINDS)
def test_rows_are_padded_to_lanes_and_what_is_outside_has_no_weight(spacing: float, kind: Topology) -> None:
    lattice = lattice_of(spacing, kind)
    rows, stride = lattice.weights.shape
    assert stride % MESH_LANES == 0
    assert not lattice.spans[[0, 1, -2, -1]].any()
    assert not lattice.weights[:, -1].any()  # the left neighbour of the next row's first lane
    for row in range(rows):
        first, count = lattice.spans[row]
        assert first % MESH_LANES == 0
        assert count % MESH_LANES == 0
        assert first + count <= stride
        inside = np.flatnonzero(lattice.weights[row])
        assert all(first <= column < first + count for column in inside)
        assert all(math.hypot(*lattice.position(row, column)) < 1.0 for column in inside)


@given(SPACINGS, KINDS)
def test_strips_hold_every_junction_once_and_only_even_ones_inside(spacing: float, kind: Topology) -> None:
    lattice = lattice_of(spacing, kind)
    stride = lattice.weights.shape[1]
    computed = np.zeros(lattice.weights.shape, int)
    for start, inner, outer, stop in strips_of(lattice):
        row, first = divmod(int(start), stride)
        assert not kind.shifted or lattice.shift(row) == 0.0
        assert start <= inner <= outer <= stop
        assert not any(int(flat) % MESH_LANES for flat in (start, inner, outer, stop))
        computed[row : row + STRIP_ROWS, first : first + int(stop - start)] += 1
        even = lattice.weights[
            row : row + STRIP_ROWS, first + int(inner - start) : first + int(outer - start)
        ]
        assert np.all(even == 1.0 / kind.neighbours)
    assert np.all(computed[lattice.weights > 0.0] == 1)
    assert computed.max() == 1


def test_the_inside_of_a_large_head_is_even() -> None:
    lattice = lattice_of(0.01)
    strips = strips_of(lattice)
    assert np.sum(strips[:, 2] - strips[:, 1]) > 0.7 * np.sum(strips[:, 3] - strips[:, 0])


def test_a_row_takes_no_more_vectors_than_it_must() -> None:
    # 31 junctions on the middle row and 32 on the shifted ones beside it: two vectors.
    assert lattice_of(1.0 / 16.0).spans[:, 1].max() == 32


@given(SPACINGS, KINDS)
def test_weights_are_even_inside_and_less_at_the_rim(spacing: float, kind: Topology) -> None:
    lattice, even = lattice_of(spacing, kind), 1.0 / kind.neighbours
    for row, column in zip(*np.nonzero(lattice.weights), strict=True):
        weight = lattice.weights[row, column]
        if math.hypot(*lattice.position(row, column)) + spacing < 1.0 - 1e-12:
            assert weight == pytest.approx(even)
        else:
            assert 0.0 < weight <= even + 1e-12


def test_a_junction_beside_the_rim_by_hand() -> None:
    """Spacing 0.4: the junction at (0.8, 0) has two neighbours inside and four cut edges."""
    lattice = lattice_of(0.4)
    straight = 0.5  # from 0.8 to 1.0 along an edge of 0.4
    # |(0.8, 0) + s (cos 60, sin 60)| = 1: s^2 + 0.8 s - 0.36 = 0
    slanted = (-0.4 + math.sqrt(0.16 + 0.36)) / 0.4
    # At 120 degrees lies (0.6, 0.346), inside.
    expected = 1.0 / (3 + 1 / straight + 2 / slanted)
    assert lattice.weights[lattice.centre_row, lattice.centre_column + 2] == pytest.approx(expected)


@given(SPACINGS, PLACES, KINDS)
def test_the_nearest_junction_is_inside_and_none_is_nearer(
    spacing: float, place: tuple[float, float], kind: Topology
) -> None:
    lattice = lattice_of(spacing, kind)
    found, _ = max(corners(lattice, place), key=lambda corner: corner[1])
    assert lattice.weights.ravel()[found] > 0.0
    at = drawn_in(*place, limit(lattice))
    inside = zip(*np.nonzero(lattice.weights), strict=True)
    distances = [math.dist(at, lattice.position(int(r), int(c))) for r, c in inside]
    assert math.dist(at, position(lattice, found)) <= min(distances) + 1e-9


@given(SPACINGS, PLACES, KINDS)
def test_a_place_lies_between_its_corners(spacing: float, place: tuple[float, float], kind: Topology) -> None:
    lattice = lattice_of(spacing, kind)
    found = corners(lattice, place)
    assert len(found) == (3 if kind.shifted else 4)
    assert sum(share for _, share in found) == pytest.approx(1.0)
    assert all(share >= -1e-9 for _, share in found)
    if limit(lattice) > 0.0:
        # A corner on the rim itself can only have no share: the place lies on a junction.
        assert all(lattice.weights.ravel()[at] > 0.0 for at, share in found if share > 1e-9)
    x = sum(share * position(lattice, flat)[0] for flat, share in found)
    y = sum(share * position(lattice, flat)[1] for flat, share in found)
    assert (x, y) == pytest.approx(drawn_in(*place, limit(lattice)), abs=1e-9)


def test_spacing_follows_the_pitch() -> None:
    # Mesh rate / f01 = 1.6 junctions across, at tau = 8/3.
    step_s = 1.0 / 16000.0
    lattice = tuned(
        150.0, step_s, scheme_of(TOPOLOGIES["triangular"], 2, False), even_losses(math.inf, step_s)
    )
    assert lattice.across == pytest.approx(0.625 * 16000.0 / 150.0, rel=2e-3)


def test_the_lowest_eigenvalue_is_that_of_the_ideal_head_where_junctions_are_many() -> None:
    for kind in TOPOLOGIES.values():
        lattice = lattice_of(0.02, kind)
        assert lowest_eigenvalue(lattice) == pytest.approx((J01 * 0.02) ** 2 / 4.0, rel=1e-3)


@pytest.mark.parametrize("spacing", [0.0, 1e-4, 0.6, math.nan])
def test_no_drum_of_three_junctions(spacing: float) -> None:
    with pytest.raises(ValueError, match="the mesh takes"):
        lattice_of(spacing)
