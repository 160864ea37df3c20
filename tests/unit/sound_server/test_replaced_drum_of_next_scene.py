"""Another scene while a drum of the one before is built or waits: it never enters, and the new one takes its time."""

import dataclasses

import pytest

from drumstick.parameters.drum import Drum as DrumOfScene
from drumstick.parameters.scene import Scene
from playing_drum import MESH, Bench, Time, pitch

OTHER = Scene("other", drum=DrumOfScene(f01_Hz=250.0, t60_s=1.0))


@pytest.mark.parametrize("is_asked_in_vain", [False, True])
def test_a_drum_of_a_scene_that_has_ended_never_enters(clock: Time, is_asked_in_vain: bool) -> None:
    bench = Bench(clock)
    bench.builder.holds = True
    bench.set(drum_f01=190.0)
    bench.link.playing, bench.link.boot, bench.link.values = OTHER, 2, {}
    bench.link.answers = not is_asked_in_vain
    bench.drum._heard_boot(2)
    bench.builder.finish()
    bench.turn(3)
    assert bench.sink.mixer.drums == (1 if is_asked_in_vain else 2)
    bench.link.answers = True
    bench.turn(3)
    assert bench.sink.mixer.drums == 2
    bench.sound(2.0)
    bench.strike(boot=2)
    assert pitch(bench.sound(0.5)) == pytest.approx(250.0, rel=0.02)
    assert bench.meter.waiting == ""


def test_nor_one_of_the_same_wish(clock: Time, built: list[DrumOfScene]) -> None:
    bench = Bench(clock)
    bench.builder.holds = True
    bench.set(drum_f01=190.0)
    bench.link.playing = dataclasses.replace(MESH, drum=dataclasses.replace(MESH.drum, radius_m=0.3))
    bench.link.boot = 2
    bench.drum._heard_boot(2)
    bench.turn()
    bench.sound(2.0)
    for _ in range(2):
        bench.turn(2)
        bench.builder.finish()
    bench.turn()
    assert [(drum.radius_m, drum.f01_Hz) for drum in built] == [
        (0.16, 150.0), (0.3, 150.0), (0.16, 190.0), (0.3, 190.0),
    ]  # fmt: skip
    assert (bench.sink.mixer.drums, bench.meter.waiting) == (2, "")


def test_beside_a_scene_that_cannot_be_played_the_drum_before_stays_as_it_is(
    clock: Time, built: list[DrumOfScene]
) -> None:
    bench = Bench(clock)
    bench.link.playing, bench.link.boot = Scene("none", drum=DrumOfScene(f01_Hz=20.0)), 2
    bench.link.values = {"drum.f01": 200.0}  # of that scene
    bench.drum._heard_boot(2)
    bench.turn(3)
    assert [drum.f01_Hz for drum in built] == [150.0, 20.0]
    assert (bench.meter.revision, bench.meter.waiting) == (-1, "")


def test_another_drum_waits_until_that_of_the_scene_before_is_silent(clock: Time) -> None:
    bench = Bench(clock)
    bench.link.playing, bench.link.boot, bench.link.values = OTHER, 2, {}
    bench.drum._heard_boot(2)
    bench.turn()
    bench.set(drum_f01=190.0)
    assert bench.meter.waiting.endswith("waits until the one before the present one is silent")
    while bench.meter.waiting:
        assert bench.sink.mixer.drums <= 2
        bench.sound(0.1)
        bench.turn()
    assert bench.clock.now_s <= 1.5
