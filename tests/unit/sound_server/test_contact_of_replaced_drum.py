"""A contact's force while its drum is replaced: it goes to one drum, from its beginning to its end."""

import threading
from typing import Any

import pytest

from drumstick.drum.build import new_engine
from drumstick.drum.memory.strikes import StrikeRing
from playing_drum import RATE, STREAMED, Bench, Time, piece

_HELD = "drum of drum.f01 190: waits for the end of a contact"


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

    def meanwhile(*given: Any) -> int:
        begins.start()
        begins.join(0.2)  # it has to wait
        return enter(*given)

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
