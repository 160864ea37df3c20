"""Pitch and decay that are set while the drum plays: another drum beside it takes its place, and nothing clicks."""

import dataclasses
import threading
from typing import Any

import numpy as np
import pytest

from drumstick.drum.build import new_engine
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.rebuilt import scene_rebuilt
from drumstick.parameters.drum import Drum as DrumOfScene
from drumstick.parameters.scene import Scene
from playing_drum import MESH, RATE, SCENES, STREAMED, STRUCK, Bench, Sound, Time, piece, roughness
from sound_server import replacement

HARD = {"mallet.mass": 0.005, "mallet.stiffness": 9e7, "mallet.exponent": 1.5, "mallet.loss": 0.3}
_HELD = "drum of drum.f01 190: waits for the end of a contact"


def _pitch(sound: Sound) -> float:
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound)), 16 * len(sound)))
    return float(np.argmax(spectrum)) * RATE / (16 * len(sound))


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
    found = [(_pitch(each[4800:24_000]), _decay_s(each[4800:24_000])) for each in (before, after)]
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


def test_of_many_values_the_newest_counts_and_two_drums_are_the_most(
    clock: Time, built: list[DrumOfScene]
) -> None:
    bench = Bench(clock)
    for f01_Hz in range(160, 200):
        bench.set(drum_f01=float(f01_Hz))
        bench.sound(0.02)
        assert bench.sink.mixer.drums <= 2
    bench.sound(1.0)
    bench.turn(2)
    assert (built[1].f01_Hz, built[-1].f01_Hz, len(built)) == (160.0, 199.0, 4)
    assert (bench.meter.revision, bench.meter.waiting) == (40, "")


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
    assert _pitch(bench.sound(0.5)) == pytest.approx(150.0, rel=0.02)
    bench.set(drum_f01=150.0)
    assert (bench.meter.revision, bench.meter.waiting) == (2, "")


def test_a_set_that_is_taken_back_while_its_drum_waits_builds_nothing_more(
    clock: Time, built: list[DrumOfScene]
) -> None:
    bench = Bench(clock)
    bench.set(drum_f01=160.0)
    bench.set(drum_f01=170.0)  # waits for the end of the first one
    bench.set(drum_f01=160.0)
    bench.sound(1.0)
    bench.turn(2)
    assert [drum.f01_Hz for drum in built] == [150.0, 160.0]


def test_the_force_of_one_contact_goes_to_one_drum(clock: Time) -> None:
    bench = Bench(clock, STREAMED)
    piece(bench, 0, 1.0, 2.0)
    bench.set(drum_f01=190.0)
    assert bench.sink.mixer.drums == 1
    assert (bench.meter.revision, bench.meter.waiting) == (0, _HELD)
    piece(bench, 2, 1.0, 0.0)
    bench.turn()
    assert bench.sink.mixer.drums == 2
    assert (bench.meter.revision, bench.meter.waiting) == (1, "")


def test_a_contact_that_begins_while_the_drum_is_built_keeps_its_own(clock: Time) -> None:
    bench = Bench(clock, STREAMED)
    bench.builder.holds = True
    bench.set(drum_f01=190.0)
    assert bench.meter.waiting == "drum of drum.f01 190: being built"
    piece(bench, 0, 1.0, 2.0)
    bench.builder.finish()
    bench.turn(3)
    assert (bench.sink.mixer.drums, bench.meter.waiting) == (1, _HELD)
    piece(bench, 2, 1.0, 0.0)
    bench.turn()
    assert (bench.sink.mixer.drums, bench.meter.waiting) == (2, "")


def test_nor_is_one_split_that_begins_while_the_drum_enters(
    clock: Time, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(clock, STREAMED)
    enter, before = bench.sink.mixer.enter, bench.drum._engine
    begins = threading.Thread(target=piece, args=(bench, 0, 1.0, 2.0))

    def meanwhile(engine: Engine) -> int:
        begins.start()
        begins.join(0.2)  # it has to wait
        return enter(engine)

    monkeypatch.setattr(bench.sink.mixer, "enter", meanwhile)
    bench.set(drum_f01=190.0)
    begins.join()
    assert before is not None
    assert bench.drum._engine is not None
    cells = [engine.stream.ring_cells.tolist() for engine in (before, bench.drum._engine)]
    untouched = new_engine(STREAMED, RATE, StrikeRing()).stream.ring_cells.tolist()
    assert cells[0] == untouched
    assert cells[1] != untouched


def test_a_contact_whose_end_never_comes_is_not_waited_for(clock: Time) -> None:
    bench = Bench(clock, STREAMED)
    piece(bench, 0, 1.0, 2.0)
    bench.set(drum_f01=190.0)
    bench.sound(0.05)
    bench.turn()
    assert bench.meter.waiting == _HELD
    bench.sound(0.2)
    bench.turn()
    assert (bench.meter.revision, bench.meter.waiting) == (1, "")


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


def test_of_values_that_come_while_one_is_built_only_the_newest_is_built_next(
    clock: Time, built: list[DrumOfScene]
) -> None:
    bench = Bench(clock)
    bench.builder.holds = True
    for f01_Hz in (160.0, 170.0, 190.0):
        bench.set(drum_f01=f01_Hz)
        assert (bench.meter.revision, bench.meter.waiting) == (0, f"drum of drum.f01 {f01_Hz:g}: being built")
    for _ in range(2):
        bench.builder.finish()
        bench.turn(2)
    assert [drum.f01_Hz for drum in built] == [150.0, 160.0, 190.0]
    assert (bench.meter.revision, bench.meter.waiting) == (3, "")
    bench.strike()
    assert _pitch(bench.sound(0.5)) == pytest.approx(190.0, rel=0.02)


def test_a_knob_that_is_turned_on_and_on_is_heard_in_steps(clock: Time) -> None:
    bench = Bench(clock)
    bench.builder.holds = True
    for f01_Hz in range(160, 200):  # no drum is built before the next value has come
        bench.set(drum_f01=float(f01_Hz))
        bench.builder.finish()
    assert bench.sink.mixer.drums == 2
    assert bench.drum._engine is not None
    assert bench.meter.revision == 0  # it is not the newest that sounds


def test_a_value_that_is_taken_back_while_its_drum_is_built_never_sounds(clock: Time) -> None:
    bench = Bench(clock)
    bench.builder.holds = True
    bench.set(drum_f01=190.0)
    bench.set(drum_f01=150.0)
    assert (bench.meter.revision, bench.meter.waiting) == (2, "")
    bench.builder.finish()
    bench.turn(3)
    assert bench.sink.mixer.drums == 1
    bench.set(drum_f01=170.0)
    bench.builder.finish()
    bench.turn(2)
    bench.strike()
    assert _pitch(bench.sound(0.5)) == pytest.approx(170.0, rel=0.02)


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
    assert _pitch(bench.sound(0.5)) == pytest.approx(250.0, rel=0.02)
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
