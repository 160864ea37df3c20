"""The stored result of strike-latency, and the time that the drum itself takes."""

from drumstick.drum.output.upsample import TAPS
from drumstick_lab.benchmarks.latency.strike_latency import (
    SCENE,
    drum_ms,
)
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
