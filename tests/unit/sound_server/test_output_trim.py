"""The output's delay and gain: what two sound servers play of the same strikes differs by what was asked, exactly."""

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.parameters.drum import Drum as DrumOfScene
from drumstick.parameters.scene import Scene
from playing_drum import NOW, RATE, Link, Sink, drum_of
from protocol.messages import Contact, encode
from rig_messages import strike
from sound_server.drum import Drum
from sound_server.mixer import Mixer, mix
from sound_server.output_trim import OutputTrim

BLOCK = 120  # blocks of 2.5 ms: no instant has to be rounded
BOOT, OFFSET = 7, 123_456_789_000
FRAMES = RATE
Sound = npt.NDArray[np.float32]


def scene_of(latency_s: float = 0.02, excitation: Any = "analytic") -> Scene:
    return Scene("drum", drum=DrumOfScene(f01_Hz=150.0, latency_s=latency_s, excitation=excitation))


def drum_in(trim: OutputTrim, scene: Scene) -> tuple[Drum, Mixer]:
    sink = Sink()
    drum = drum_of(Link(scene, boot=BOOT, offset_ns=OFFSET), sink, trim)
    assert drum._catch_up()
    return drum, sink.mixer


def sound_of(mixer: Mixer, frames: int = FRAMES) -> Sound:
    out = np.zeros((frames, 2), np.float32)
    for first in range(0, frames, BLOCK):
        mix(mixer.buffers, out[first : first + BLOCK], RATE, NOW + round(first * 1e9 / RATE))
    return out


def strikes() -> list[bytes]:
    return [
        encode(
            strike(
                boot=BOOT, seq=seq, t_ns=NOW + OFFSET + round(at_s * 1e9), x=0.3, y=0.1, z_speed_m_per_s=0.6,
                level=0.3, peak_estimate_N=2.0, contact_estimate_s=0.004,
            )
        )
        for seq, at_s in enumerate((0.0, 0.0433, 0.0866))
    ]  # fmt: skip


def struck(trim: OutputTrim, scene: Scene) -> Sound:
    drum, mixer = drum_in(trim, scene)
    for message in strikes():
        drum._strikes.take(message, NOW)
    assert drum._strikes.played == 3
    return sound_of(mixer)


@pytest.mark.parametrize("ms", [10.0, 25.0, 500.0])
def test_two_rooms_play_the_same_strikes_apart_by_what_was_asked(ms: float) -> None:
    scene = scene_of()
    here, there = struck(OutputTrim(), scene), struck(OutputTrim(1e-3 * ms), scene)
    apart = round(1e-3 * ms * RATE)
    assert apart % 3 == 0  # a whole number of the mesh's steps
    assert np.abs(here).max() > 0.05
    assert np.array_equal(there[apart:], here[:-apart])
    assert not there[: apart + round(0.02 * RATE)].any()


def test_two_rooms_of_a_scene_without_latency_play_apart_too() -> None:
    """The strikes come as they are made here; the one server plays at once, the other when it is time."""
    there = struck(OutputTrim(0.03), scene_of(0.0))
    first = int(np.flatnonzero(np.abs(there).max(axis=1) > 1e-4)[0])
    assert 0 <= first - 0.03 * RATE < 0.002 * RATE


def test_without_a_clock_the_room_still_comes_later() -> None:
    drum, mixer = drum_in(OutputTrim(0.1), scene_of(0.0))
    drum._strikes.clock = None
    drum._strikes.take(strikes()[0], NOW)
    sound = sound_of(mixer)
    first = int(np.flatnonzero(np.abs(sound).max(axis=1) > 1e-4)[0])
    assert 0 <= first - 0.1 * RATE < 0.002 * RATE


def test_a_streamed_force_comes_later_by_the_same() -> None:
    sounds: list[Sound] = []
    for trim in (OutputTrim(), OutputTrim(0.3)):
        drum, mixer = drum_in(trim, scene_of(0.05, "streamed"))
        assert drum._strikes.note is not None
        force = 3.0 * np.sin(np.pi * (np.arange(8) + 0.5) / 8)
        for seq, at in ((1, 0), (2, 40)):
            piece = Contact(
                boot=BOOT, seq=seq, first_tick=at, rate_Hz=1000.0, forces=np.append(force, 0.0).astype("<f4").tobytes(),
                t_ns=NOW + OFFSET + at * 1_000_000, x=0.3, y=0.1,
            )  # fmt: skip
            drum._contacts.take(encode(piece), NOW)
        sounds.append(sound_of(mixer))
    here, there = sounds
    apart = round(0.3 * RATE)
    assert np.abs(here).max() > 0.01
    assert there[apart:] == pytest.approx(here[:-apart], abs=2e-4 * float(np.abs(here).max()))
    assert not there[:apart].any()


def test_the_level_is_the_rooms() -> None:
    scene = scene_of()
    quiet = dataclasses.replace(scene, listen=dataclasses.replace(scene.listen, gain_dB=-24.0))
    here, there = struck(OutputTrim(), quiet), struck(OutputTrim(0.0, -12.0), quiet)
    assert there == pytest.approx(10.0 ** (-12.0 / 20.0) * here.astype(float), abs=1e-6)


def test_the_meter_says_which_room_it_is() -> None:
    drum, _ = drum_in(OutputTrim(), scene_of())
    assert drum._meter().sink == "nothing"
    drum, _ = drum_in(OutputTrim(0.02, -6.0), scene_of())
    assert drum._meter().sink == "nothing, 20 ms later, -6 dB"
