"""Pitch and decay that are set while the drum plays: another drum beside it takes its place, and nothing clicks."""

import dataclasses
import threading
from typing import Any

import numpy as np
import pytest

from clicks import roughness
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.rebuilt import scene_rebuilt
from drumstick.parameters.drum import Drum as DrumOfScene
from drumstick.parameters.drum import Mesh
from drumstick.parameters.scene import Scene
from playing_drum import MESH, RATE, SCENES, STRUCK, Bench, Sound, Time, pitch
from sound_server import replacement

HARD = {"mallet.mass": 0.005, "mallet.stiffness": 9e7, "mallet.exponent": 1.5, "mallet.loss": 0.3}


def _decay_s(sound: Sound) -> float:
    halves = np.split(sound[: len(sound) // 2 * 2], 2)
    first, second = (float(np.sqrt(np.mean(half**2))) for half in halves)
    return 60.0 * len(sound) / 2 / RATE / (20.0 * np.log10(first / second))


@pytest.mark.parametrize("kind", SCENES)
def test_the_next_strike_has_the_pitch_and_decay_that_were_set(clock: Time, kind: str) -> None:
    bench = Bench(clock, SCENES[kind])
    bench.strike()
    before = bench.sound(1.0)
    bench.set(drum_f01=190.0, drum_t60=0.5)
    bench.sound(1.0)
    bench.strike()
    after = bench.sound(1.0)
    found = [(pitch(each[4800:24_000]), _decay_s(each[4800:24_000])) for each in (before, after)]
    assert [pitch for pitch, _ in found] == pytest.approx([150.0, 190.0], rel=0.01)
    assert [decay for _, decay in found] == pytest.approx([1.0, 0.5], rel=0.05)


def test_the_next_strike_is_that_of_the_mallet_that_was_set(clock: Time) -> None:
    set_live, from_the_scene = Bench(clock, STRUCK), Bench(clock, scene_rebuilt(STRUCK, HARD))
    soft = Bench(clock, STRUCK)
    set_live.set(**{name.replace(".", "_", 1): value for name, value in HARD.items()})
    assert set_live.meter.waiting == ""
    for bench in (set_live, from_the_scene, soft):
        bench.sound(0.6)
        bench.strike()
    sound = set_live.sound(0.2)
    assert np.array_equal(sound, from_the_scene.sound(0.2))
    assert np.abs(sound - soft.sound(0.2)).max() > 0.1 * np.abs(sound).max()


def test_a_mallet_that_is_set_twice_while_its_drum_is_built_is_the_newest(clock: Time) -> None:
    bench, newest = Bench(clock, STRUCK), Bench(clock, scene_rebuilt(STRUCK, {"mallet.mass": 0.1}))
    bench.builder.holds = True
    bench.set(mallet_mass=0.05)
    bench.set(mallet_mass=0.1)
    assert bench.meter.waiting == "drum of mallet.mass 0.1: being built"
    for _ in range(2):
        bench.builder.finish()
        bench.turn(2)
    assert bench.meter.waiting == ""
    for each in (bench, newest):
        each.sound(0.6)
        each.strike()
    assert np.array_equal(bench.sound(0.2), newest.sound(0.2))


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize(
    ("own", "name", "set_to", "other"),
    [
        ({"glide_cents": 30.0}, "tension_glide", {"glide_cents": 240.0}, "tension_young"),
        ({"young_GPa": 1.0}, "tension_young", {"young_GPa": 8.0}, "tension_glide"),
    ],
)
def test_the_next_strike_glides_as_far_as_was_set(
    clock: Time, kind: str, own: dict[str, float], name: str, set_to: dict[str, float], other: str
) -> None:
    def of(values: dict[str, float]) -> Bench:
        drum = dataclasses.replace(MESH.drum, effects={"tension": TensionTable(**values)})
        return Bench(clock, dataclasses.replace(SCENES[kind], drum=drum))

    set_live, from_the_scene, before = of(own), of(set_to), of(own)
    before.set(**{other: 5.0})  # which counts for nothing there
    present = set_live.drum._engine
    set_live.set(**{name: next(iter(set_to.values()))})
    assert set_live.meter.waiting == ""
    assert set_live.drum._engine is not present
    for bench in (set_live, from_the_scene, before):
        bench.sound(0.6)
        bench.strike()
    sound = set_live.sound(0.1)
    assert np.array_equal(sound, from_the_scene.sound(0.1))
    assert np.abs(sound - before.sound(0.1)).max() > 0.05 * np.abs(sound).max()


def test_the_next_strike_has_the_second_head_that_was_set_and_one_that_cannot_be_leaves_it(
    clock: Time,
) -> None:
    def of(f01_Hz: float) -> Bench:
        drum = dataclasses.replace(MESH.drum, effects={"cavity": CavityTable(f01_Hz=f01_Hz)})
        return Bench(clock, dataclasses.replace(MESH, drum=drum, mesh=Mesh(rate_Hz=4000.0)))

    set_live, from_the_scene, before = of(180.0), of(320.0), of(180.0)
    set_live.set(cavity_f01=320.0)
    assert set_live.meter.waiting == ""
    for bench in (set_live, from_the_scene, before):
        bench.sound(0.6)
        bench.strike()
    sound = set_live.sound(0.1)
    assert np.array_equal(sound, from_the_scene.sound(0.1))
    assert np.abs(sound - before.sound(0.1)).max() > 0.05 * np.abs(sound).max()
    set_live.set(cavity_f01=1900.0)  # fewer junctions across than a mesh can have
    assert "drum of cavity.f01 1900: cannot be built" in set_live.meter.waiting
    assert "radii apart" in set_live.meter.waiting
    assert np.array_equal(set_live.sound(0.1), from_the_scene.sound(0.1))


def test_a_scene_without_a_mallet_builds_nothing_for_one(clock: Time, built: list[DrumOfScene]) -> None:
    bench = Bench(clock)
    bench.set(mallet_mass=0.05)
    assert (bench.meter.waiting, len(built)) == ("", 1)
    assert scene_rebuilt(MESH, {"mallet.mass": 0.05}) == MESH


def test_a_drum_in_whose_place_another_comes_rings_on_and_fades_without_a_click(clock: Time) -> None:
    changed, other = Bench(clock), Bench(clock)
    for bench in (changed, other):
        bench.strike()
        bench.sound(0.05)
    changed.set(drum_f01=190.0)
    ring, as_it_was = changed.sound(0.5), other.sound(0.5)
    assert np.array_equal(ring, as_it_was)
    faded = changed.sound(0.2)
    assert np.abs(faded[:480]).max() > 0.001
    assert not faded[-4800:].any()
    assert roughness(np.concatenate([ring[-4800:], faded])) <= 1.5 * roughness(as_it_was[-4800:])
    assert changed.sink.mixer.has_left(0)


def test_what_waits_is_told_until_it_sounds(clock: Time, built: list[DrumOfScene]) -> None:
    bench = Bench(clock)
    bench.set(listen_gain=-3.0)
    assert (bench.meter.revision, bench.meter.waiting) == (1, "")
    bench.link.meters.clear()
    bench.set(drum_f01=190.0)
    told = [(meter.revision, meter.waiting) for meter in bench.link.meters]
    assert told == [(1, "drum of drum.f01 190: being built"), (2, "")]
    assert [drum.f01_Hz for drum in built] == [150.0, 190.0]


def test_the_new_drum_is_as_loud_as_the_old_one_was_set_and_both_follow(clock: Time) -> None:
    bench, loud = Bench(clock), Bench(clock)
    bench.set(listen_gain=-20.0)
    for each in (bench, loud):
        each.set(drum_f01=190.0)
        each.strike()
    assert bench.sound(0.1) == pytest.approx(0.1 * loud.sound(0.1), abs=1e-6)
    loud.set(listen_mute=1.0)
    loud.sound(0.1)
    assert not loud.sound(0.1).any()


def test_a_drum_that_cannot_be_built_changes_nothing_and_is_told(
    clock: Time, built: list[DrumOfScene]
) -> None:
    bench = Bench(clock)
    bench.set(drum_f01=20.0)
    bench.turn(2)
    assert (bench.meter.revision, bench.meter.waiting) == (
        0,
        "drum of drum.f01 20: cannot be built: no wave fits",
    )
    assert len(built) == 2  # it is not tried again and again
    bench.strike()
    assert pitch(bench.sound(0.5)) == pytest.approx(150.0, rel=0.02)
    bench.set(drum_f01=150.0)
    assert (bench.meter.revision, bench.meter.waiting) == (2, "")


def test_a_full_mixer_is_asked_again_while_the_present_drum_follows_what_is_set(clock: Time) -> None:
    bench = Bench(clock)
    mixer, present = bench.sink.mixer, bench.drum._engine
    assert present is not None
    others = [mixer.enter(present) for _ in range(15)]
    bench.set(drum_f01=190.0)
    for gain_dB in (-20.0, -30.0, -40.0):
        bench.set(listen_gain=gain_dB)
        assert "16 drums sound already" in bench.meter.waiting
        assert bench.meter.revision == 0
        assert float(present.listening.target["listen_gain"][0]) == gain_dB
        bench.clock.now_s += 1.1
    mixer.leave(others[0])
    bench.sound(1.1)
    bench.turn()
    assert (bench.meter.revision, bench.meter.waiting) == (4, "")
    assert bench.drum._engine is not present


def test_nothing_waits_for_the_thread_that_builds_and_what_fails_there_is_raised() -> None:
    may_go, made, entered = threading.Event(), object(), list[object]()

    def make(_scene: Scene, _original: Scene) -> Any:
        assert may_go.wait(60.0)
        if entered:
            raise RuntimeError("no memory")
        return made

    def enter(found: object) -> float:
        entered.append(found)
        return 0.0

    found = replacement.Replacement(make, enter)
    found.play(MESH, 0.0)
    for _ in range(3):
        assert not found.step({"drum.f01": 190.0})
    assert found.waiting == "drum of drum.f01 190: being built"
    may_go.set()
    assert found._building is not None
    found._building.result(60.0)
    assert found.step({"drum.f01": 190.0})
    assert entered == [made]
    assert not found.step({"drum.f01": 200.0})
    assert found._building.exception(60.0)
    with pytest.raises(RuntimeError, match="no memory"):
        found.step({"drum.f01": 200.0})
