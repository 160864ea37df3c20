"""The laboratory's JACK client hears what the sound server writes, at its own time."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from haptic_side import HapticSide, drum, sounding, wait_for
from jack_server import Jack

from drumstick_lab.benchmarks.latency.first_samples import cycles_of
from drumstick_lab.benchmarks.latency.jack_listener import JackListener

pytestmark = [pytest.mark.needs("jackd"), pytest.mark.long]
BLOCK = 128  # of the tests' JACK server


def test_it_hears_the_sound_server_block_by_block(
    own_folders: dict[str, str], free_port: Callable[[], int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    side = HapticSide(free_port(), drum())
    jack = Jack(own_folders, tmp_path)
    try:
        wait_for("JACK", jack.is_up)
        for name, value in jack.environment.items():
            monkeypatch.setenv(name, value)
        with sounding(side.endpoint, "auto", tmp_path, jack.environment):
            side.meter("JACK", lambda m: "JACK" in m.sink)
            listener = JackListener("listener", 60.0, BLOCK)
            assert listener.rate_Hz == 48_000
            assert listener.playback_latency_ms() == pytest.approx(2e3 * BLOCK / 48_000)
            began_ns = time.monotonic_ns()
            (left, *_) = listener.outputs()
            listener.listen(left)
            side.struck("a sound", lambda m: m.peak_left > 0.0 and m.played > 0)
            wait_for("what was struck", lambda: listener.loudest > 0.0)
            recorded = listener.close()
            ended_ns = time.monotonic_ns()
    finally:
        jack.close()
        side.close()
    assert np.all(np.diff(recorded.cycles[:, 0]) == BLOCK)
    frames = np.diff(recorded.cycles[:, 1])
    assert np.all((frames > 0) & (frames % BLOCK == 0))
    called_ns = recorded.cycles[:, 2]
    assert np.all((called_ns > began_ns) & (called_ns < ended_ns))
    # A cycle may have begun long before its callback ran, on a busy machine even before `listen`, but not after.
    assert np.all(cycles_of(recorded).begun_ns <= called_ns)
    assert 0.0 < np.abs(recorded.samples).max() <= 1.0
