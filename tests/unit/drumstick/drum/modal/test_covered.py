"""Shares of a bank's modes under patches: within 0 and 1, so that no press makes energy; whole heads and signs."""

import math

import numpy as np
import pytest

from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.modal.covered import Covered, Patches, covered_by
from drumstick.parameters.drum import Drum

HIGHEST = 60.0  # zero j


def _covered(patches: Patches) -> Covered:
    found = covered_by(HIGHEST, Drum(effects={"muffle": MuffleTable(patches)}))
    assert found is not None
    return found


@pytest.mark.parametrize(
    "patches", [((0.0, 0.0, 1.0),), ((0.75, 0.0, 0.15),), ((-0.2, 0.9, 0.01), (0.0, 0.0, 0.02))]
)
def test_no_share_is_below_nothing_or_above_all(patches: Patches) -> None:
    """Not by rounding either: a share below 0 would be a patch that drives."""
    shares = _covered(patches).shares
    assert shares.min() >= 0.0
    assert shares.max() <= 1.0
    assert shares.max() > 0.0


def test_a_patch_as_large_as_the_head_covers_every_mode() -> None:
    covered = _covered(((0.0, 0.0, 1.0),))
    orders = covered.shares[: covered.turn.shape[1]]
    np.testing.assert_allclose(orders, 1.0, atol=2e-3)
    np.testing.assert_array_equal(covered.turn[0], 1.0)


def test_a_radius_counts_by_its_size() -> None:
    """As on a mesh: a scene may give it with either sign."""
    one, other = (_covered(((0.3, 0.4, radius),)) for radius in (0.25, -0.25))
    np.testing.assert_array_equal(one.shares, other.shares)
    assert one.shares.max() > 0.05


def test_a_patch_turned_about_the_middle_turns_the_pairs_and_nothing_else() -> None:
    angle = 0.7
    along, aside = (
        _covered(((0.6, 0.0, 0.2),)),
        _covered(((0.6 * math.cos(angle), 0.6 * math.sin(angle), 0.2),)),
    )
    count = along.turn.shape[1]
    pairs = [np.sort(found.shares.reshape(2, count), axis=0) for found in (along, aside)]
    np.testing.assert_allclose(pairs[1], pairs[0], atol=1e-6)
