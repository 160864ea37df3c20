import io
import os
import subprocess
import sys
import threading
import wave
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.calibrate import build
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from sound_server.sinks import reconnecting, selection
from sound_server.sinks.paced import PacedSink
from sound_server.sinks.sink import SinkError
from sound_server.sinks.wavfile import WavFile


def frames_of(content: bytes) -> int:
    with wave.open(io.BytesIO(content)) as file:
        assert (file.getnchannels(), file.getsampwidth(), file.getframerate()) == (2, 2, 48000)
        return file.getnframes()


def test_the_file_can_be_read_at_any_moment(tmp_path: Path) -> None:
    path = tmp_path / "roll.wav"
    file = WavFile(path, 48000)
    assert frames_of(path.read_bytes()) == 0
    for n in range(1, 4):
        file.record(np.full((100, 2), 0.5, np.float32))
        assert frames_of(path.read_bytes()) == 100 * n
    file.close()
    file.close()
    with wave.open(str(path)) as written:
        samples = np.frombuffer(written.readframes(300), "<i2")
    assert (samples == 16384).all()


def test_the_file_ends_at_its_limit_and_says_so_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    path = tmp_path / "roll.wav"
    file = WavFile(path, 48000, longest_s=0.005)
    for _ in range(5):
        file.record(np.zeros((100, 2), np.float32))
    assert frames_of(path.read_bytes()) == 240
    assert [r.getMessage() for r in caplog.records] == [f"{path} is full; playing on without recording"]


@pytest.mark.timeout(20)
def test_what_is_no_file_is_a_wrong_request(tmp_path: Path) -> None:
    unread = tmp_path / "unread"
    os.mkfifo(unread)
    for path in (unread, Path("/dev/null")):
        with pytest.raises(SinkError, match="cannot be written: not a regular file") as refusal:
            selection.wav(path, 48000, 128)
        assert refusal.value.status == 2


def test_a_full_disk_at_the_start_is_a_wrong_request(tmp_path: Path) -> None:
    """In a process of its own, whose files may not grow beyond ten bytes."""
    path = tmp_path / "roll.wav"
    program = f"""
import pathlib, resource
from sound_server.sinks import selection
from sound_server.sinks.sink import SinkError
resource.setrlimit(resource.RLIMIT_FSIZE, (10, 10))
try:
    selection.wav(pathlib.Path({str(path)!r}), 48000, 128)
except SinkError as error:
    print(error.status, error)
"""
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    assert run.stdout == f"2 {path} cannot be written: File too large\n"


def test_a_full_disk_later_ends_the_recording_only(tmp_path: Path) -> None:
    """In a process of its own, whose files may not grow beyond 1000 bytes: the last write comes through in part."""
    path = tmp_path / "roll.wav"
    program = f"""
import logging, pathlib, resource, signal
import numpy as np
from sound_server.sinks.wavfile import WavFile
logging.basicConfig(format="%(message)s")
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
file = WavFile(pathlib.Path({str(path)!r}), 48000)
for _ in range(5):
    file.record(np.zeros((100, 2), np.float32))
file.close()
"""
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    assert run.stderr == f"{path}: File too large; the recording ends here\n"
    assert path.stat().st_size == 1000
    assert frames_of(path.read_bytes()) == 200


def test_a_paced_sink_plays_in_real_time_and_changes_drums() -> None:
    heard: list[npt.NDArray[np.float32]] = []
    enough = threading.Event()
    finished: list[bool] = []

    def record(sound: npt.NDArray[np.float32]) -> None:
        heard.append(sound.copy())
        if len(heard) == 6:
            enough.set()

    sink = PacedSink("test", 48000, 128, record, lambda: finished.append(True))
    ring = StrikeRing()
    first, second = build(Scene("a"), 48000, ring), build(Scene("b"), 48000, StrikeRing())
    place = sink.mixer.enter(first)
    ring.push(0, 0.5, 0.0, 5.0, 0.004)
    assert enough.wait(60.0)
    sink.mixer.enter(second)
    sink.mixer.leave(place)
    already = len(heard)
    enough.clear()
    while len(heard) < already + 3:
        enough.wait(0.01)
    sink.close()
    assert finished == [True]
    assert max(np.abs(sound).max() for sound in heard) > 0.01
    played, later = int(first.meters["frames"][0]), int(second.meters["frames"][0])
    everything = sum(len(s) for s in heard)
    assert 0 < later < everything
    assert everything - later < played < everything  # they overlap while the first one fades
    assert sink.load > 0.0


def test_a_sink_that_never_played_closes() -> None:
    PacedSink("null", 48000, 128).close()


@pytest.mark.parametrize("wish", ["wav:", "wav:/no/such/folder/roll.wav"])
def test_a_file_that_cannot_be_is_a_wrong_request(wish: str) -> None:
    with pytest.raises(SinkError) as refusal:
        selection.open_sink(wish, 48000, 128)
    assert refusal.value.status == 2
    assert "\n" not in str(refusal.value)


class NoSound:
    """Stands for sounddevice on a machine with these output devices."""

    class PortAudioError(Exception):
        pass

    def __init__(self, names: list[str]) -> None:
        self.names = names

    def query_hostapis(self) -> list[dict[str, object]]:
        return [{"name": "ALSA", "default_output_device": -1}]

    def query_devices(self) -> list[dict[str, object]]:
        return [{"name": name, "hostapi": 0, "max_output_channels": 2} for name in self.names]


def test_an_unknown_name_lists_the_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sounddevice", NoSound(["Scarlett 2i2", "HDMI"]))
    with pytest.raises(
        SinkError, match=r"'organ'; there are: Scarlett 2i2 \(ALSA\); HDMI \(ALSA\)"
    ) as refusal:
        selection.open_sink("organ", 48000, 128)
    assert refusal.value.status == 3


@pytest.mark.parametrize(
    ("library", "reason"), [(None, "no audio library"), (NoSound([]), "no audio output device")]
)
def test_auto_falls_back_to_a_file_and_says_why(
    library: object,
    reason: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level("INFO")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "sounddevice", library)  # None: importing it raises ImportError
    sink = selection.open_sink("auto", 48000, 128)
    sink.close()
    assert sink.description == f"wav:{selection.FALLBACK_FILE}"
    assert reason in caplog.text
    assert str(tmp_path / selection.FALLBACK_FILE) in caplog.text
    assert frames_of((tmp_path / selection.FALLBACK_FILE).read_bytes()) == 0


def test_auto_that_is_awaited_waits_for_any_device_and_writes_no_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "sounddevice", NoSound([]))
    with pytest.raises(SinkError, match="no audio output device") as refusal:
        selection.open_sink("auto", 48000, 128, awaited=True)
    assert refusal.value.status == 3
    sink = reconnecting.placeholder_sink("auto", refusal.value, 48000, 128)
    assert sink.description == "waiting for an audio device"
    assert "no audio output device; no audio until an audio device is available" in caplog.text
    assert not list(tmp_path.iterdir())
    for said, there in (("", False), ("Scarlett 2i2 (ALSA)\n", True)):
        monkeypatch.setattr(subprocess, "run", lambda *_, said=said, **__: CompletedProcess([], 0, said, ""))
        assert reconnecting.is_there("auto") == there


def test_auto_without_anywhere_to_write_plays_for_nobody(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / selection.FALLBACK_FILE).mkdir()
    monkeypatch.setitem(sys.modules, "sounddevice", NoSound([]))
    sink = selection.open_sink("auto", 48000, 128)
    sink.close()
    assert sink.description == "null"
    assert "nothing will be heard" in caplog.text
