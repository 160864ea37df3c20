"""A choke: what rings ends within 30 ms and without a click, and the next strike sounds as on a drum at rest."""

import dataclasses
import logging
from typing import Any

import numpy as np
import pytest

from clicks import roughness
from drumstick.drum.calibrate import build
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.sympathy import SympathyTable
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.fade import CHOKE_S
from drumstick.parameters.drum import Drum
from drumstick.parameters.scene import Scene
from playing_drum import BLOCK, MESH, NOW, RATE, SCENES, STREAMED, Bench, Time, piece
from protocol.rate_limited_log import RateLimitedLog
from sound_server.mixer import SLOTS

FADE = round(CHOKE_S * RATE) + BLOCK  # samples: it begins with a block
HEARS = Scene("snare", drum=Drum(effects={"cavity": CavityTable(), "sympathy": SympathyTable(200.0, 0.0)}))
LATE = dataclasses.replace(MESH, drum=dataclasses.replace(MESH.drum, latency_s=0.1))


def struck(clock: Time, kind: str = "mesh") -> Bench:
    """A drum that has rung for 0.1 s."""
    bench = Bench(clock, SCENES[kind])
    bench.strike()
    bench.sound(0.1)
    return bench


@pytest.mark.parametrize("kind", SCENES)
def test_what_rings_is_silent_after_the_fade_and_nothing_clicks(clock: Time, kind: str) -> None:
    choked, other = struck(clock, kind), struck(clock, kind)
    choked.choke()
    faded, ring = choked.sound(0.2), other.sound(0.2)
    assert np.abs(ring[FADE:]).max() > 0.01
    assert not faded[FADE:].any()
    half = FADE // 2
    assert np.sqrt(np.mean(faded[half:FADE] ** 2)) < 0.3 * np.sqrt(np.mean(ring[half:FADE] ** 2))
    assert np.abs(np.diff(faded)).max() <= np.abs(np.diff(ring)).max()
    assert roughness(faded) <= 1.2 * roughness(ring)
    assert choked.sink.mixer.has_left(0)


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("after_s", [0.0, 0.01, 0.02, 0.5])
def test_the_next_strike_sounds_at_once_and_as_on_a_drum_at_rest(
    clock: Time, kind: str, after_s: float
) -> None:
    choked, rested = struck(clock, kind), Bench(clock, SCENES[kind])
    rested.sound(0.1)
    choked.choke()
    for bench in (choked, rested):
        bench.sound(after_s)
        bench.strike()
    sound, expected = choked.sound(0.2), rested.sound(0.2)
    assert np.array_equal(sound[FADE:], expected[FADE:])
    assert np.abs(expected[FADE:]).max() > 0.01


def test_each_choke_of_a_quick_row_ends_the_strike_before_it(clock: Time) -> None:
    bench = Bench(clock)
    for _ in range(20):
        bench.strike()
        bench.sound(0.01)
        bench.choke()
        assert bench.sink.mixer.drums <= 6  # those that still fade
    bench.sound(0.05)
    assert not bench.sound(0.1).any()
    assert bench.drum._strikes.played == 20


def test_a_drum_that_nobody_struck_is_left_alone(clock: Time) -> None:
    bench = struck(clock)
    bench.choke()
    engine = bench.drum._engine
    for _ in range(100):
        bench.choke()
    assert bench.drum._engine is engine
    assert bench.sink.mixer.drums == 2


def test_a_choke_that_comes_twice_counts_once_and_nonsense_not_at_all(clock: Time) -> None:
    bench = struck(clock)
    bench.choke(seq=7)
    bench.strike()
    bench.choke(seq=7)
    bench.drum._strikes.take_choke(b"nonsense", NOW)
    bench.sound(0.1)
    assert bench.sound(0.1).any()
    assert (bench.drum._strikes.duplicates, bench.drum._strikes.refused) == (1, 1)


def test_it_keeps_the_latency_of_the_strikes(clock: Time) -> None:
    """Strikes that come at once with their choke are heard until they are due to end: not at all, or as one blow."""
    choked, other = Bench(clock, LATE), Bench(clock, LATE)
    for bench in (choked, other):
        bench.strike()
        bench.strike()
    choked.choke()
    sounds = [bench.sound(0.1) for bench in (choked, other)]
    assert np.array_equal(*sounds)
    assert not choked.sound(0.2)[FADE:].any()


def test_the_drum_is_as_loud_afterwards_as_it_was_set(clock: Time) -> None:
    choked, rested = Bench(clock), Bench(clock)
    for bench in (choked, rested):
        bench.set(listen_gain=-20.0)
        bench.sound(0.5)
    choked.strike()
    choked.choke()
    choked.set(listen_pan=1.0)  # the left is silent
    choked.sound(0.5)
    choked.strike()
    assert not choked.sound(0.1).any()
    choked.set(listen_pan=0.0)
    choked.choke()
    for bench in (choked, rested):
        bench.sound(0.5)
        bench.strike()
    assert np.array_equal(choked.sound(0.1), rested.sound(0.1))


def test_a_drum_in_whose_place_another_has_come_is_choked_too(clock: Time) -> None:
    bench = struck(clock)
    bench.set(drum_f01=190.0)
    assert bench.sound(0.1).any()  # it rings on
    bench.choke()
    assert not bench.sound(0.1)[FADE:].any()
    assert bench.sink.mixer.has_left(0)
    bench.strike()
    bench.sound(0.1)
    bench.choke()
    assert not bench.sound(0.1)[FADE:].any()


def test_a_choke_while_another_drum_is_built_ends_what_sounds_and_not_what_comes(clock: Time) -> None:
    bench, plain = struck(clock), Bench(clock)
    bench.builder.holds = True
    bench.set(drum_f01=190.0)
    bench.choke()
    assert not bench.sound(0.1)[FADE:].any()
    bench.builder.finish()
    bench.turn(3)
    assert bench.meter.waiting == ""
    plain.set(drum_f01=190.0)
    plain.sound(0.1)
    for each in (bench, plain):
        each.sound(0.7)
        each.strike()
    assert np.array_equal(bench.sound(0.1), plain.sound(0.1))


def test_a_contact_that_is_choked_stays_with_its_drum_and_the_next_one_sounds(clock: Time) -> None:
    bench, rested = Bench(clock, STREAMED), Bench(Time(), STREAMED)  # each by its own clock
    for each in (bench, rested):
        each.sound(0.1)
    piece(bench, 0, 1.0, 2.0)
    bench.sound(0.02)
    bench.choke()
    piece(bench, 2, 2.0, 2.0, 2.0, 2.0, 1.0, 0.0)
    rested.sound(0.02)
    faded = bench.sound(0.1)
    rested.sound(0.1)
    assert not faded[FADE:].any()
    for each in (bench, rested):
        piece(each, 200, 1.0, 2.0, 1.0, 0.0, seq=2)
    sound = bench.sound(0.1)
    assert sound.any()
    assert np.array_equal(sound, rested.sound(0.1))


def test_in_a_full_mixer_the_drum_rings_on_and_that_is_logged(
    clock: Time, caplog: pytest.LogCaptureFixture
) -> None:
    bench = struck(clock)
    assert bench.drum._engine is not None
    for _ in range(SLOTS - 1):
        bench.sink.mixer.enter(bench.drum._engine)
    with caplog.at_level(logging.WARNING):
        bench.choke()
    assert "choke left out: 16 drums sound already" in caplog.text
    assert bench.sound(0.1)[FADE:].any()


def changed(bench: Bench, scene: Scene) -> None:
    """The rig plays another scene."""
    bench.link.playing, bench.link.boot = scene, bench.link.boot + 1
    bench.drum._heard_boot(bench.link.boot)
    bench.turn()


def test_drums_of_scenes_that_ended_just_before_are_choked_too(clock: Time) -> None:
    bench = struck(clock)
    for f01_Hz in (190.0, 250.0):
        changed(bench, Scene("other", drum=Drum(f01_Hz=f01_Hz)))
    assert bench.sound(0.1).any()  # the first of the three rings on
    bench.choke()
    assert not bench.sound(0.1)[FADE:].any()


def test_a_drum_that_only_heard_others_is_choked_while_it_rings(clock: Time) -> None:
    bench, ring = Bench(clock, HEARS), StrikeRing()
    neighbour = build(MESH, RATE, ring)
    slot = bench.sink.mixer.enter(neighbour)
    ring.push(1, 0.3, 0.1, 30.0, 0.005, 0.0, 0.0)
    bench.sound(0.1)
    bench.sink.mixer.leave(slot)
    bench.sound(0.1)
    assert bench.sink.mixer.has_left(slot)
    assert bench.sound(0.1).any()
    for _ in range(100):  # the first one counts
        bench.choke()
    assert bench.sink.mixer.drums == 2
    assert not bench.sound(0.1)[FADE:].any()


def test_a_contact_that_is_choked_twice_stays_where_it_began(clock: Time) -> None:
    bench, other = Bench(clock, STREAMED), Bench(Time(), STREAMED)
    for each in (bench, other):
        piece(each, 0, 1.0, 2.0)
        each.sound(0.02)
        each.choke()
        each.sound(0.1)
        each.drum._contacts.played += 1  # as one that is over already
        each.choke()
    piece(bench, 130, 2.0, 2.0, 2.0, 2.0, 1.0, 0.0)
    assert np.array_equal(bench.sound(0.1), other.sound(0.1))


def test_a_long_contact_that_is_choked_is_no_news(clock: Time) -> None:
    """Nobody takes the rest of its force any more, and nobody is to hear it."""
    bench = Bench(clock, STREAMED)
    messages: list[str] = []
    bench.drum._contacts._log_limited = RateLimitedLog(lambda: 0, 0.0, messages.append)
    piece(bench, 0, 1.0, 2.0)
    bench.sound(0.02)
    bench.choke()
    bench.sound(0.1)
    for tick in range(120, 420):
        piece(bench, tick, 2.0)
        bench.sound(0.001)
    assert not messages


def test_a_drum_that_has_left_is_choked_no_more(clock: Time) -> None:
    bench = struck(clock)
    bench.drum.leave(lambda: True)
    bench.choke()
    assert bench.sink.mixer.drums == 1
    bench.sound(0.1)
    assert bench.sink.mixer.has_left(0)
    bench.strike()
    bench.choke()
    assert bench.sink.mixer.drums == 0


def test_a_drum_whose_slot_another_has_taken_has_left(clock: Time) -> None:
    bench, asked = struck(clock), 0

    def abandoned() -> bool:
        # Between two looks it fades, and a neighbour enters where it was.
        nonlocal asked
        asked += 1
        if asked == 1:
            bench.sound(0.1)
            assert bench.sink.mixer.enter(build(MESH, RATE, StrikeRing())) == 0
        return asked > 3

    bench.drum.leave(abandoned)
    assert asked == 1


def test_the_page_shows_the_drum_before_until_all_of_the_next_is_known(
    clock: Time, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A choke comes while the next drum's shapes are computed."""
    bench = struck(clock, "modes")
    display = bench.drum._display
    before, show = display._drum, display.show

    def late(*given: Any) -> None:
        bench.strike(bench.link.boot)
        bench.choke()
        assert display._drum is before
        show(*given)

    monkeypatch.setattr(display, "show", late)
    changed(bench, MESH)
    assert display._drum is not None
    assert display._drum.engine is bench.drum._engine
