"""A head that resists bending: its modes beside the closed form; and what is refused."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.special import jn_zeros

from drumstick.drum.effects.air import AirTable
from drumstick.drum.modal.air_load import in_air, zero_at
from drumstick.drum.modal.building import bank_of
from drumstick.parameters.drum import Drum, Modal
from drumstick.parameters.scene import Scene

RADIUS_M, F01_HZ, SIGMA, BENDING = 0.152, 136.0, 0.3, 0.005


def head(bending_N_m: float, density: float = 1.2) -> Drum:
    air = AirTable(density, SIGMA, "none", bending_N_m)
    return Drum(radius_m=RADIUS_M, f01_Hz=F01_HZ, effects={"air": air})


def test_in_vacuum_the_modes_follow_tension_and_bending_stiffness() -> None:
    """sigma w^2 = T k^2 + D k^4, with the tension that gives (0,1) its pitch."""
    found = in_air(100.0, head(BENDING, density=0.0))
    k01 = jn_zeros(0, 1)[0] / RADIUS_M
    tension = SIGMA * (2.0 * math.pi * F01_HZ / k01) ** 2 - BENDING * k01**2
    k = found.modes.zeros / RADIUS_M
    wanted_Hz = np.sqrt((tension * k**2 + BENDING * k**4) / SIGMA) / (2.0 * math.pi)
    np.testing.assert_allclose(found.f_Hz, wanted_Hz, rtol=1e-6)
    np.testing.assert_allclose(found.of_tension(), tension / (tension + BENDING * k**2), rtol=1e-5)
    assert wanted_Hz[-1] > 1.2 * F01_HZ * found.modes.zeros[-1] / found.modes.zeros[0]


def test_in_air_high_modes_rise_and_low_ones_stay() -> None:
    plain, bent = (in_air(120.0, head(bending)) for bending in (0.0, BENDING))
    rise = bent.f_Hz / plain.f_Hz
    assert rise[0] == pytest.approx(1.0, abs=1e-6)
    assert 1.0 < rise[9] < 1.01
    assert rise[-1] == pytest.approx(math.sqrt(1.0 / bent.of_tension()[-1]), rel=0.02)
    assert rise[-1] > 1.15


@pytest.mark.parametrize("top_Hz", [3000.0, 10_000.0])
def test_the_bank_reaches_as_high_as_was_asked_for_with_fewer_modes(top_Hz: float) -> None:
    counts: list[int] = []
    for bending in (0.0, BENDING):
        drum = head(bending)
        assert in_air(zero_at(top_Hz, drum), drum).f_Hz.max() == pytest.approx(top_Hz, rel=0.01)
        counts.append(len(bank_of(Scene("head", drum=drum, modal=Modal(top_Hz)), 1.0 / 48_000).orders))
    assert counts[1] < counts[0]


def test_what_cannot_be_is_said() -> None:
    with pytest.raises(ValueError, match="lower bending_N_m"):
        in_air(20.0, dataclasses.replace(head(1.0), f01_Hz=30.0))
    with pytest.raises(ValueError, match="Hz waves are as fast as sound: lower bending_N_m"):
        in_air(100.0, head(0.3))  # to 27 kHz, where they would overtake it
    slack = Drum(radius_m=1.0, f01_Hz=40.0, effects={"air": AirTable(bending_N_m=1.0)})
    with pytest.raises(ValueError, match="as fast as sound: lower bending_N_m"):
        zero_at(20_000.0, slack)
