"""A block size that fails leaves the others; JACK has one for all."""

import subprocess
import sys
from dataclasses import replace
from typing import Any, NamedTuple

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from protocol.messages import CONTACT_PIECE_S
from rig.machine import audio_measurement
from rig.machine.audio_advice import Delay, Row
from rig.machine.audio_measurement import _STREAMED, AudioTest
from sound_server.sinks.sink import SinkError


def _row(block: int, lost: str) -> Row:
    return Row(
        block=block, block_ms=block / 48.0, priority="SCHED_FIFO 5", real_time=True, granted=True, blocks=1000,
        share_p50=0.1, share_p99=0.2, share_worst=0.4, share_ours_p99=0.2, late=0, late_ours=0, xruns=0, xruns_ours=0,
        waited_ms=1.0, device_ms=1.0, delay_ms=Delay(1.0, 2.0, 3.0),
        lost=lost,
    )  # fmt: skip


class Fake(NamedTuple):
    """A sink that is lost, or not; `closed` notes its block when it is closed."""

    description: str
    block: int
    lost: str
    closed: list[int]

    def close(self) -> None:
        self.closed.append(self.block)


def outcome(
    monkeypatch: pytest.MonkeyPatch, device: str, only: int | None, lost_at: int, silent_at: int
) -> tuple[dict[str, Any], list[int]]:
    """Findings of a test on a device like this, and the blocks whose sink was closed."""
    closed: list[int] = []
    test = AudioTest(parse(shipped_text("roll"), "roll"), "auto", 48_000, 1.0, 24.0)

    def opened(_audio: str, _rate: int, block: int, awaited: bool) -> Fake:
        return Fake(device, block, "it stopped" if block == lost_at else "", closed)

    def measure(sink: Fake, block: int) -> None:
        if block == silent_at:
            raise SinkError(3, "it stands still")
        test._rows.append(_row(block, sink.lost))

    monkeypatch.setattr(audio_measurement, "only_block", lambda *_: only)
    monkeypatch.setattr(audio_measurement, "open_sink", opened)
    monkeypatch.setattr(test, "_measure", measure)
    return test.run((32, 64, 128)), closed


def test_one_silent_block_size_leaves_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    found, closed = outcome(monkeypatch, "card (ALSA)", only=None, lost_at=0, silent_at=64)
    assert [told["block"] for told in found["rows"]] == [32, 128]
    assert found["refused"] == [{"block": 64, "reason": "it stands still"}]
    assert closed == [32, 64, 128]


def test_a_lost_device_leaves_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    found, closed = outcome(monkeypatch, "card (ALSA)", only=None, lost_at=64, silent_at=0)
    assert [told["block"] for told in found["rows"]] == closed == [32, 64, 128]


def test_jack_has_one_block_and_is_not_closed_when_it_was_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    found, closed = outcome(
        monkeypatch, "system (JACK Audio Connection Kit)", only=64, lost_at=64, silent_at=0
    )
    assert [told["block"] for told in found["rows"]] == [64]
    assert [told["block"] for told in found["refused"]] == [32, 128]
    assert "jack_bufsize 32" in found["refused"][0]["reason"]
    assert closed == []
    assert any("jack_bufsize" in words for words in found["advice"])


def test_a_machine_without_portaudio_can_be_tested_on_null() -> None:
    without = "import sys; sys.modules['sounddevice'] = None; import rig.machine.audio_measurement"
    subprocess.run([sys.executable, "-c", without], check=True)


@pytest.mark.parametrize("streamed", [False, True])
def test_a_streamed_force_takes_its_own_time(streamed: bool) -> None:
    scene = parse(shipped_text("bare-drum"), "bare-drum")
    drum = replace(scene.drum, excitation="streamed" if streamed else "analytic")
    found = AudioTest(replace(scene, drum=drum), "null", 48_000, 0.2, 50.0).run((256,))
    least_ms = 1e3 * (3 * CONTACT_PIECE_S + 256 / 48_000) if streamed else 0.0
    for told in found["rows"]:
        way_ms = told["delay_ms"]["least"] - told["device_ms"]
        assert way_ms >= least_ms - 1e-9
        assert told["device_ms"] < told["block_ms"]  # of no device, but of the interpolator
    assert (_STREAMED in found["advice"]) == streamed
