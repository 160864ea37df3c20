"""The audio device without one: a PortAudio of the test's own, with and without the private door."""

import dataclasses
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from sound_server.sinks.sink import SinkError

try:
    from sound_server.sinks import device
except OSError as missing:
    pytest.skip(f"{missing}: sudo apt-get install libportaudio2", allow_module_level=True)


@dataclasses.dataclass
class Flags:
    output_underflow: bool = False


class Stream:
    """Remembers how it was opened; `active` is the test's to change."""

    def __init__(self, **wishes: Any) -> None:
        self.wishes = wishes
        self.active = False
        self.latency = 0.01

    def start(self) -> None:
        self.active = True

    def close(self, ignore_errors: bool = True) -> None:
        self.active = False


class PortAudio:
    """A library with one device that plays at `rates` only and has no C door."""

    class PortAudioError(Exception):
        pass

    OutputStream = Stream

    def __init__(self, rates: tuple[int, ...] = (48000,), channels: int = 2) -> None:
        self.rates, self.channels = rates, channels

    def query_devices(self, _index: int) -> dict[str, object]:
        return {
            "name": "card",
            "hostapi": 0,
            "max_output_channels": self.channels,
            "default_samplerate": float(self.rates[0]),
        }

    def query_hostapis(self, _index: int) -> dict[str, object]:
        return {"name": "TEST"}

    def check_output_settings(self, *, device: int, samplerate: int, dtype: str) -> None:
        if samplerate not in self.rates:
            raise self.PortAudioError("Invalid sample rate")


@pytest.fixture
def portaudio(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    def install(**facts: Any) -> None:
        monkeypatch.setattr(device, "sounddevice", PortAudio(**facts))

    return install


def test_without_the_private_door_python_plays_the_same(
    portaudio: Callable[..., None], caplog: pytest.LogCaptureFixture
) -> None:
    portaudio()
    sink = device.DeviceSink(0, 48000, 128)
    assert "without _StreamBase" in caplog.text
    callback = sink._stream.wishes["callback"]
    out = np.full((128, 2), 9.0, np.float32)
    callback(out, 128, None, Flags())
    assert not out.any()
    ring = StrikeRing()
    sink.mixer.enter(build(Scene("drum"), 48000, ring))
    sounds: list[np.ndarray] = []
    for frame in range(20):
        if frame == 0:
            ring.push(0, 0.3, 0.3, 5.0, 0.004)
        callback(out, 128, None, Flags(output_underflow=frame == 3))
        sounds.append(out.copy())
    ring.push(0, 0.3, 0.3, 5.0, 0.004)
    offline = np.zeros((20 * 128, 2), np.float32)
    render_all(build(Scene("drum"), 48000, ring), offline, 128, 0)
    assert np.array_equal(np.concatenate(sounds), offline)
    assert sink.xruns == 1
    assert sink.description == "card (TEST)"


def test_a_latency_below_nothing_is_none() -> None:
    assert device.reported_latency_s(0.02, 48000) == 0.02
    assert device.reported_latency_s((2**32 - 128) / 48000, 48000) == 0.0


def test_a_device_keeps_its_own_rate_when_it_has_to(portaudio: Callable[..., None]) -> None:
    portaudio(rates=(44100, 96000))
    assert device.playable_rate(0, 96000) == 96000
    assert device.playable_rate(0, 48000) == 44100


def test_a_device_that_is_too_slow_is_refused(portaudio: Callable[..., None]) -> None:
    portaudio(rates=(8000,))
    with pytest.raises(SinkError, match="plays at 8000 Hz; 22050 Hz are needed") as refusal:
        device.DeviceSink(0, 48000, 128)
    assert refusal.value.status == 3


def test_a_stream_that_stops_by_itself_is_lost(portaudio: Callable[..., None]) -> None:
    portaudio(channels=1)
    sink = device.DeviceSink(0, 48000, 128)
    assert sink._stream.wishes["channels"] == 1
    assert sink.lost == ""
    sink._stream.active = False
    assert sink.lost == "the device stopped"


ALSA_PLAYS = """
import os
from sound_server.sinks.device import DeviceSink
sink = DeviceSink(0, 48000, 256)
print([os.sched_getscheduler(int(tid)) for tid in os.listdir("/proc/self/task")].count(os.SCHED_FIFO))
os._exit(0)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="ALSA is Linux's")
def test_the_audio_thread_of_an_alsa_device_has_real_time(tmp_path: Path) -> None:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    except PermissionError:
        pytest.skip("needs the right to real time: ulimit -r 1")
    (tmp_path / "alsa").write_text("pcm.!default { type null }\nctl.!default { type null }\n")
    nothing_else = {"ALSA_CONFIG_PATH": str(tmp_path / "alsa"), "JACK_NO_START_SERVER": "1"}
    done = subprocess.run(
        [sys.executable, "-c", ALSA_PLAYS], capture_output=True, text=True, check=False, timeout=200,
        env={**os.environ, **nothing_else, "JACK_DEFAULT_SERVER": "none"},
    )  # fmt: skip
    assert done.stdout.strip() == "1", done.stderr
