"""A tension and a mallet on finer and finer meshes, with the same drum and the same blow in SI: what converges."""

import numpy as np
import pytest

from drumstick_lab.benchmarks.scenes.refinement import MESHES_HZ, push, relative, rise, study
from stability.catalogue import shows


@shows("tension on a finer mesh")
def test_a_tension_converges_by_the_second_order_and_under_a_point_force_it_does_not() -> None:
    """At a point force a membrane has no height: what bends there grows with the logarithm of the spacing."""
    free, struck = (
        study("tension", "rise", "", lambda rate, struck=struck: rise(rate, struck), relative)
        for struck in (False, True)
    )
    assert free["order"] == pytest.approx(2.0, abs=0.2)
    assert struck["order"] < 0.5
    assert struck["changes"][1] > 0.05  # and is no rounding


def test_a_mallet_on_a_disc_converges_and_on_a_point_it_does_not() -> None:
    """Under a disc a membrane has a height: modes shorter than the disc see none of the push."""
    mesh, modes = (
        study("mallet", "force", "", lambda rate, on_modes=on_modes: push(rate, on_modes), relative)
        for on_modes in (False, True)
    )
    assert modes["order"] > 2.0
    assert mesh["order"] < 0.5


def test_the_order_of_what_is_known() -> None:
    """A quantity that is off by the square of the mesh's step, and one that is off by more on each mesh."""

    def order(power: float) -> float:
        def off(rate_Hz: float) -> np.ndarray:
            return np.array([1.0 + (MESHES_HZ[0] / rate_Hz) ** power])

        return study("", "", "", off, lambda one, finer: float(abs(finer - one)[0]))["order"]

    assert order(2.0) == pytest.approx(2.0)
    assert order(-1.0) == pytest.approx(-1.0)
