"""Values that come while a drum is built: the newest counts, and one that is taken back never sounds."""

import pytest

from drumstick.parameters.drum import Drum as DrumOfScene
from playing_drum import Bench, Time, pitch


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
    assert pitch(bench.sound(0.5)) == pytest.approx(190.0, rel=0.02)


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
    assert pitch(bench.sound(0.5)) == pytest.approx(170.0, rel=0.02)
