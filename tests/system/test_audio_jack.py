"""The compiled callback on a real-time device: JACK's dummy driver, with the sound server as its client."""

import dataclasses
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from haptic_side import HapticSide, drum, sounding
from jack_server import Jack, jack_server
from rig_process import PATIENCE_S, wait_for

from sound_server.outputs import outputs_of

pytestmark = pytest.mark.needs("jackd")


@pytest.fixture
def side(free_port: Callable[[], int]) -> Iterator[HapticSide]:
    opened = HapticSide(free_port(), drum())
    yield opened
    opened.close()


def _ports(jack: Jack) -> list[str]:
    listed = subprocess.run(
        ["jack_lsp", "-c"], capture_output=True, text=True, check=True, env=jack.environment
    )
    return listed.stdout.splitlines()


def test_two_rigs_and_a_microphone_have_ports_of_their_names(
    own_folders: dict[str, str], free_port: Callable[[], int], tmp_path: Path
) -> None:
    """JACK lists the ports, and what each of them is connected to; the meters show that both drums sound."""
    above = dataclasses.replace(drum().listen, microphones=((-0.3, 0.3, 0.5, -0.4), (0.4, 0.4, 0.5, 0.4)))
    left = HapticSide(free_port(), dataclasses.replace(drum(), listen=above), rig="left-drum")
    right = left.another("right-drum", drum(f01_Hz=210.0))
    outputs = outputs_of(
        "left-drum=1-2,left-drum/microphone-2=5-6,right-drum=3-4,right-drum/microphone-1=1-2"
    )
    try:
        with (
            jack_server(own_folders, tmp_path, outputs=6) as jack,
            sounding(
                left.endpoint, "auto", tmp_path, jack.environment, "left-drum,right-drum", outputs
            ) as sound,
        ):
            # Two kinds of drum, which may have to be compiled one after the other.
            wait_for(
                "two drums",
                lambda: sum("mesh of" in line for line in sound.lines) == 2,
                4.0 * PATIENCE_S,
            )
            for side in (left, right):
                heard = side.struck("a sound", lambda m: m.peak_left > 0.0 and m.played > 0)
                assert "JACK" in heard.sink
            ports = _ports(jack)
            assert sound.stop(signal.SIGTERM) == 0
    finally:
        left.close()
    names = [
        "left-drum.left+right-drum/microphone-1.left", "left-drum.right+right-drum/microphone-1.right",
        "right-drum.left", "right-drum.right", "left-drum/microphone-2.left", "left-drum/microphone-2.right",
    ]  # fmt: skip
    for number, name in enumerate(names, 1):
        at = next(at for at, port in enumerate(ports) if port.endswith(f":{name}") and port[0] != " ")
        assert ports[at + 1] == f"   system:playback_{number}"
    wrong = [line for line in sound.lines if "ERROR" in line or "WARNING" in line]
    assert wrong == ["ERROR: --outputs: right-drum/microphone-1: scene test-drum has only pickup-1, pickup-2"]


def test_a_channel_that_the_device_has_not_is_refused(jack: Jack, side: HapticSide, tmp_path: Path) -> None:
    with sounding(side.endpoint, "auto", tmp_path, jack.environment, outputs=outputs_of("main=3-4")) as sound:
        assert sound.ended() == 2
    assert any("has 2 output channels; --outputs names channel 4" in line for line in sound.lines)


@pytest.mark.parametrize("audio", ["auto", "jack audio"])
@pytest.mark.daily("auto")
def test_it_plays_and_reports_load(audio: str, jack: Jack, side: HapticSide, tmp_path: Path) -> None:
    with sounding(side.endpoint, audio, tmp_path, jack.environment) as sound:
        first = side.meter("JACK", lambda m: "JACK" in m.sink)
        heard = side.struck("a sound", lambda m: m.peak_left > 0.0 and m.played > 0)
        assert heard.load > 0.0  # of wall time: a callback that lost its processor may tell more than 1
        assert heard.xruns >= 0
        assert heard.latency_ms > 128 / 48.0
        assert first.sink == heard.sink
        side.scene, side.boot = drum(f01_Hz=300.0), 8
        side.tell_state()
        sound.said("mesh of 33.3 junctions across")
        side.struck("the other drum", lambda m: m.played > heard.played and m.peak_left > 0.0)
        assert sound.stop(signal.SIGTERM) == 0
    assert not any("Python" in line for line in sound.lines)  # the compiled callback, not the fallback


@pytest.mark.long
def test_a_stalled_process_is_counted_as_xruns(jack: Jack, side: HapticSide, tmp_path: Path) -> None:
    with sounding(side.endpoint, "auto", tmp_path, jack.environment) as sound:
        before = side.meter("JACK", lambda m: "JACK" in m.sink).xruns
        sound.process.send_signal(signal.SIGSTOP)
        started = side.now_ns()
        wait_for("a stall of a fifth of a second", lambda: side.now_ns() > started + 200_000_000)
        sound.process.send_signal(signal.SIGCONT)
        side.meter("more xruns", lambda m: m.xruns > before)
        assert sound.stop(signal.SIGTERM) == 0


@pytest.mark.long
def test_a_lost_device_is_awaited_and_played_again(jack: Jack, side: HapticSide, tmp_path: Path) -> None:
    with sounding(side.endpoint, "auto", tmp_path, jack.environment) as sound:
        device = side.meter("JACK", lambda m: "JACK" in m.sink).sink
        number = sound.process.pid
        jack.close()
        side.meter("a stand-in", lambda m: m.sink == f"waiting for {device}")
        side.struck("the drum, unheard", lambda m: m.played > 0 and m.peak_left > 0.0)
        jack.start()
        side.meter("JACK again", lambda m: m.sink == device)
        side.struck("a sound", lambda m: m.sink == device and m.played > 0 and m.peak_left > 0.0)
        assert sound.process.pid == number
        assert sound.stop(signal.SIGTERM) == 0
    said = [line for line in sound.lines if "mesh of" not in line]
    lost, waiting, back = [line for line in said if device in line]
    assert lost == f"ERROR: audio device lost: {device}: the device stopped"
    assert waiting.startswith("WARNING: no audio output device")
    assert waiting.endswith(f"; no audio until {device} is available")
    assert back == f"{device} is there"


@pytest.mark.long
def test_stop_while_a_device_is_awaited(jack: Jack, side: HapticSide, tmp_path: Path) -> None:
    with sounding(side.endpoint, "auto", tmp_path, jack.environment) as sound:
        side.meter("JACK", lambda m: "JACK" in m.sink)
        jack.close()
        side.meter("a stand-in", lambda m: m.sink.startswith("waiting for"))
        assert sound.stop(signal.SIGTERM) == 0
        jack.start()  # the fixture ends it
