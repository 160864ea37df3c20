"""Servo's part of `drumstick accuracy`: prediction brings the rebound back to the design, a faster tick too."""

import numpy as np
import pytest

from drumstick_lab.accuracy.servo import DELAYS, RATES_HZ
from drumstick_lab.accuracy.sticks import falling
from drumstick_lab.accuracy.sticks.falling import Sampled, rebounds
from haptic_server.limits import lag_s

STIFFNESSES = (500.0, 1000.0, 3500.0)


def _mean(k_coll: float, rate_hz: int, delay: int, predictor: str) -> float:
    return float(np.mean(rebounds(Sampled(k_coll, rate_hz, delay, predictor).scene(), guarded=False)))


@pytest.mark.daily("1000-*")
@pytest.mark.parametrize("k_coll", STIFFNESSES)
@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_prediction_brings_the_rebound_nearer_to_the_design(rate_hz: int, delay: int, k_coll: float) -> None:
    """By more than half of what was off; without it the rendering always adds energy."""
    design = falling.design(k_coll)
    off, lead = (_mean(k_coll, rate_hz, delay, predictor) for predictor in ("off", "lead"))
    assert off > design
    assert abs(lead - design) < 0.5 * (off - design)


@pytest.mark.parametrize("k_coll", STIFFNESSES)
@pytest.mark.parametrize("rate_hz", [1000, 2000, 4000])
def test_with_it_and_without_delay_the_rebound_is_the_designs(rate_hz: int, k_coll: float) -> None:
    """To 1.5 %, where the contact has 14 ticks or more."""
    assert falling.ticks_in_contact(k_coll, rate_hz) > 13.0
    assert _mean(k_coll, rate_hz, 0, "lead") == pytest.approx(falling.design(k_coll), rel=0.015)


@pytest.mark.parametrize("k_coll", STIFFNESSES)
def test_without_it_lag_is_negative_damping_and_a_faster_tick_has_less(k_coll: float) -> None:
    """R_eff = R_in - K T/2, to 2 % (the estimate of v is late as well)."""
    found = [_mean(k_coll, rate_hz, 0, "off") for rate_hz in (1000, 2000, 4000)]
    assert found[0] > found[1] > found[2] > falling.design(k_coll)
    for rate_hz, mean in zip((1000, 2000, 4000), found, strict=True):
        lag = lag_s(Sampled(k_coll, rate_hz, 0, "off").scene())
        assert mean == pytest.approx(falling.theory(k_coll, lag), rel=0.02)


def test_the_guard_keeps_what_would_give_more_than_it_took() -> None:
    """3500 N/m a tick late at 1 kHz, which the envelope refuses."""
    scene = Sampled(3500.0, 1000, 1, "off").scene()
    assert not falling.passes(scene)
    assert min(rebounds(scene, guarded=False)) > 1.3
    assert max(rebounds(scene, guarded=True)) < 1.05
