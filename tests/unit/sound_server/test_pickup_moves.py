"""Pickups that are set while the drum plays, in the sound server: pending until they are there, and kept."""

import dataclasses

import numpy as np
import pytest

from clicks import roughness
from drumstick.drum.engine import Engine
from drumstick.drum.pickups import fade, places
from drumstick.parameters.drum import Listen, Modal
from drumstick.parameters.scene import Scene
from playing_drum import MESH, Bench, Sound, Time

LIVE = dataclasses.replace(MESH, listen=Listen(pickup_places="live"))
THERE = {"pickup-1.x": 0.0, "pickup-1.y": 0.0, "pickup-2.x": -0.3, "pickup-2.y": -0.5}


def _set(bench: Bench, places: dict[str, float] = THERE) -> None:
    bench.set(**{name.replace(".", "_"): value for name, value in places.items()})


def _struck(bench: Bench, seconds: float = 0.2) -> Sound:
    bench.strike()
    return bench.sound(seconds)


@pytest.mark.parametrize(
    "scene", [LIVE, dataclasses.replace(LIVE, modal=Modal(top_Hz=4000.0))], ids=["mesh", "modes"]
)
def test_a_set_is_pending_until_the_fade_has_led_there_and_nothing_clicks(clock: Time, scene: Scene) -> None:
    moved, stays, there = (Bench(clock, scene) for _ in range(3))
    _set(there)
    there.sound(0.01)
    for bench in (moved, stays, there):
        before = _struck(bench, 0.1)
    _set(moved)
    assert moved.meter.revision == stays.meter.revision == 0
    fade, as_it_was, beyond = (bench.sound(0.04) for bench in (moved, stays, there))
    moved.turn()
    assert moved.meter.revision == 1
    assert np.abs(fade - as_it_was).max() > 0.05 * np.abs(before).max()
    assert roughness(fade) <= 1.5 * max(roughness(as_it_was), roughness(beyond))
    assert moved.sound(0.1) == pytest.approx(there.sound(0.1), abs=2e-6)


def test_a_drum_that_is_silent_hears_there_from_the_first_stroke_on(clock: Time) -> None:
    bench, late = Bench(clock, LIVE), Bench(clock, LIVE)
    _set(bench)
    bench.sound(0.01)
    bench.turn()
    assert bench.meter.revision == 1
    first = _struck(bench)
    _set(late)
    late.sound(0.1)
    np.testing.assert_array_equal(first, _struck(late))


def test_a_choke_and_another_pitch_leave_the_pickups_where_they_are_set(clock: Time) -> None:
    kept, anew = Bench(clock, LIVE), Bench(clock, LIVE)
    for bench in (kept, anew):
        _set(bench)
        bench.sound(0.1)
        _struck(bench)
    kept.choke()
    kept.sound(0.8)
    anew.sound(20.0)
    np.testing.assert_array_equal(_struck(kept), _struck(anew))
    kept.set(drum_f01=190.0)
    kept.sound(0.7)
    after = Bench(clock, dataclasses.replace(LIVE, drum=dataclasses.replace(LIVE.drum, f01_Hz=190.0)))
    _set(after)
    after.sound(0.1)
    np.testing.assert_array_equal(_struck(kept), _struck(after))


def test_the_newest_of_what_is_set_during_a_fade_counts(clock: Time) -> None:
    bench = Bench(clock, LIVE)
    _struck(bench, 0.05)
    _set(bench, {"pickup-1.x": 0.2})
    _set(bench, {"pickup-1.x": 0.3})
    _set(bench, THERE)
    bench.sound(0.04)
    assert bench.meter.revision < 3
    bench.turn()
    bench.sound(0.04)
    bench.turn()
    assert bench.meter.revision == 3


def test_what_moves_pickups_is_compiled_before_the_drum_plays(
    clock: Time, monkeypatch: pytest.MonkeyPatch
) -> None:
    settled: list[Engine] = []

    def settle_now(engine: Engine) -> None:
        settled.append(engine)
        fade.settle_now(engine)

    monkeypatch.setattr(places, "settle_now", settle_now)
    bench = Bench(clock, LIVE)
    assert [id(engine) for engine in settled] == [id(bench.drum._rest)]


@pytest.mark.usefixtures("built")
def test_pickups_move_though_the_drum_of_another_pitch_cannot_be_built(clock: Time) -> None:
    bench, other = Bench(clock, LIVE), Bench(clock, LIVE)
    bench.set(drum_f01=20.0)
    assert "cannot be built" in bench.meter.waiting
    for each in (bench, other):
        _set(each)
        each.sound(0.1)
    np.testing.assert_array_equal(_struck(bench), _struck(other))


def test_a_scene_that_does_not_ask_has_nothing_that_moves(clock: Time) -> None:
    bench, other = Bench(clock), Bench(clock)
    assert bench.drum._engine is not None
    assert bench.drum._engine.pickup_fade is None
    _set(bench)
    assert bench.meter.revision == 1
    np.testing.assert_array_equal(_struck(bench), _struck(other))
