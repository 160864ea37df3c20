"""The stored result of strike-latency, and the time that the drum itself takes."""

import pytest

from drumstick.drum.output.upsample import TAPS
from drumstick_lab.benchmarks.latency.strike_latency import (
    GOAL_MS,
    SCENE,
    SPREAD_GOAL_MS,
    drum_ms,
    spread_ms,
)
from drumstick_lab.measuring.stored import read
from protocol.messages import Strike


def test_the_drum_itself_takes_its_interpolator_and_the_contacts_rise() -> None:
    strike = Strike(
        boot=1, seq=1, t_ns=0, x=0.0, y=0.0, z_speed_m_per_s=0.6, level=0.3, peak_estimate_N=5.0,
        contact_estimate_s=0.005, impulse_N_s=0.015,
    )  # fmt: skip
    text = SCENE.format(excitation="analytic", latency_s=0.0)
    soft_ms, loud_ms = drum_ms(text, strike, 0.01), drum_ms(text, strike, 0.1)
    middle_ms = 1e3 * TAPS / 2 * 3 / 48_000
    # A filter of linear phase rises before its middle.
    assert 0.0 < soft_ms < loud_ms < middle_ms + 0.5


def test_the_stored_latency_is_within_its_goals() -> None:
    rows = read("strike_latency")["rows"]
    assert rows["at_once"]["sound_ms"]["p50"] <= GOAL_MS
    assert spread_ms(rows["later"]["sound_ms"]) <= spread_ms(rows["later"]["idle_ms"]) + SPREAD_GOAL_MS
    for row in rows.values():
        assert row["rest_of_threshold"] < 1.0
        assert row["unheard"] <= 0.01 * row["strikes"]
    assert rows["later"]["late"] == 0


@pytest.mark.parametrize("excitation", ["analytic", "streamed"])
def test_the_scene_can_be_read(excitation: str) -> None:
    from drumstick.scenes.scene_text import parse

    scene = parse(SCENE.format(excitation=excitation, latency_s=0.006), "latency")
    assert scene.drum.latency_s == 0.006
    assert scene.listen.pickups == ((0.0, 0.0, 0.0),)
