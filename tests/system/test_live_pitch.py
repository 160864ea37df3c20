"""Pitch that is set by OSC while a whole rig is played: the next strikes have it, everybody says so, nothing clicks."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import zenoh
from osc_port import OscPort
from rig_process import PATIENCE_S, Listener, Rig, ask, wait_for
from wav_heard import RATE, heard_in, sound_in

from protocol.messages import Meter, Readback, decode

LOW_HZ, HIGH_HZ = 150.0, 240.0
# The stick hangs above the head, so that only what is played by OSC sounds. It rings long: a cut would be heard.
SCENE = f"""
[stick]
z_ss_m = 0.05
[drum]
f01_Hz = {LOW_HZ}
t60_s = 3.0
"""
Sound = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def rig(heard: Path) -> Iterator[Rig]:
    with heard_in(heard, SCENE) as started:
        yield started


def _strike_until(what: str, osc: OscPort, meters: Listener[Meter], good: Callable[[Meter], bool]) -> int:
    # Eight more strikes that are heard, at the earliest; how many meters there were when the first good one came.
    found, end = 0, time.monotonic() + PATIENCE_S
    first = meters.got[-1].played
    while not found or meters.got[-1].played < first + 8:
        assert time.monotonic() < end, f"struck in vain for {what}"
        known = len(meters.got)
        osc.send("/drumstick/play/strike", 0.3, 0.1, 0.5)
        wait_for("a meter", lambda known=known: len(meters.got) > known + 1)
        found = found or next((k for k, meter in enumerate(meters.got) if good(meter)), 0)
    return found


def _pitch(sound: Sound) -> float:
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound))))
    return float(np.argmax(spectrum)) * RATE / len(sound)


def test_a_pitch_that_is_set_by_osc_is_that_of_the_next_strikes(
    rig: Rig, session: zenoh.Session, osc: OscPort, heard: Path
) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    wait_for("a meter of a rig that was asked", lambda: meters.got and meters.got[-1].revision >= 0)
    _strike_until("eight strikes", osc, meters, lambda meter: meter.played > 0)
    frames_low = len(sound_in(heard))

    osc.send("/drumstick/param/drum.f01", HIGH_HZ)
    assert osc.receive("/drumstick/param/drum.f01", HIGH_HZ)
    readback = decode(ask(session, rig.keys.param("drum.f01")), Readback)
    assert (readback.value, readback.pending) == (HIGH_HZ, False)
    at = _strike_until("the new drum", osc, meters, lambda meter: meter.revision >= readback.revision)
    frames_high = len(sound_in(heard))
    # From the set on it was told as waiting, until it sounded, and not for a moment longer.
    got = list(meters.got)
    assert [meter.waiting for meter in got[at:]] == [""] * (len(got) - at)
    assert all(meter.revision < readback.revision for meter in got[:at])
    _strike_until("eight more", osc, meters, lambda meter: meter.played > 0)
    assert rig.stop() == 0

    sound = sound_in(heard)[:, 0]
    low, _, high = np.split(sound, [frames_low, frames_high])
    assert [_pitch(low), _pitch(high)] == pytest.approx([LOW_HZ, HIGH_HZ], rel=0.02)
