"""Delay of a stream: computed, it is what a rig that played was measured to have."""

import numpy as np
import pytest

from drumstick_lab.accuracy.drums.stream_onset import onsets_s, percentiles_ms
from drumstick_lab.measuring import stored


def test_it_is_that_of_the_rig_which_was_measured() -> None:
    latency = stored.read("strike_latency")
    measured = latency["rows"]["streamed"]["sound_ms"]
    computed = percentiles_ms(onsets_s(1e3 / latency["tick_ms"], latency["block"]))
    for each in ("p1", "p50", "p99"):
        assert computed[each] == pytest.approx(measured[each], abs=0.35)


def test_a_longer_block_adds_itself() -> None:
    short, long = (onsets_s(4000.0, block, 2) for block in (64, 256))
    assert long - short == pytest.approx(np.full(2, 192.0 / 48_000.0))
    assert percentiles_ms(np.array([0.001, 0.002, 0.003]))["p50"] == 2.0
