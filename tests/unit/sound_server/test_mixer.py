"""Drums side by side, and drums that leave without a click."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.sympathy import SympathyTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.limiter import limited
from drumstick.drum.render import render
from drumstick.parameters.drum import Drum, Mesh
from drumstick.parameters.scene import Scene
from sound_server import second_thread
from sound_server.mixer import EMPTY, GONE, LEAVING, PLAYING, SLOTS, Mixer, MixerFull, mix
from stability.catalogue import shows

RATE = 48_000
BLOCK = 128
Sound = npt.NDArray[np.float32]


def struck(f01_Hz: float, x: float = 0.3, onset_ns: int = 0) -> Engine:
    ring = StrikeRing()
    engine = build(Scene("drum", drum=Drum(f01_Hz=f01_Hz)), RATE, ring)
    ring.push(onset_ns, x, 0.1, 2.0, 0.004)
    return engine


def alone(engine: Engine, frames: int) -> Sound:
    out = np.zeros((frames, 2), np.float32)
    render_all(engine, out, BLOCK, 0)
    return out


def played(mixer: Mixer, frames: int, channels: int = 2, block: int = BLOCK, first: int = 0) -> Sound:
    out = np.zeros((frames, channels), np.float32)
    for start in range(0, frames, block):
        mix(mixer.buffers, out[start : start + block], RATE, int((first + start) * 1e9 / RATE))
    return out


def test_two_drums_sound_as_the_sum_of_each() -> None:
    mixer = Mixer(RATE)
    mixer.enter(struck(150.0))
    mixer.enter(struck(210.0))
    parts = alone(struck(150.0), 4096).astype(float) + alone(struck(210.0), 4096)
    assert np.abs(parts).max() < 0.75  # the limiter changes nothing
    assert played(mixer, 4096) == pytest.approx(parts, abs=1e-6)


def test_the_sum_is_limited_once() -> None:
    mixer = Mixer(RATE)
    for _ in range(16):
        mixer.enter(struck(150.0))
    one = alone(struck(150.0), 4096).astype(float)
    found = played(mixer, 4096)
    assert np.abs(16.0 * one).max() > 1.1
    assert np.abs(found).max() < 1.0
    assert found[:, 0] == pytest.approx([limited(16.0 * x) for x in one[:, 0]], abs=1e-5)


def test_a_block_longer_than_the_scratch_comes_in_parts() -> None:
    whole, parts = Mixer(RATE), Mixer(RATE)
    for mixer in (whole, parts):
        mixer.enter(struck(150.0, onset_ns=45_000_000))
    assert np.allclose(played(whole, 8192, block=8192), played(parts, 8192), atol=1e-6)


def _rough(sound: Sound) -> float:
    # A click is a jump, in the sound or in its slope: the third difference shows it far above a drum's own.
    return float(np.abs(np.diff(sound[:, 0].astype(float), n=3)).max())


def _cut_off(mixer: Mixer, slot: int) -> None:
    mixer.buffers.states[slot] = GONE


@shows("another drum in every block")
@pytest.mark.parametrize(("end", "clicks"), [(Mixer.leave, False), (_cut_off, True)])
def test_a_drum_leaves_without_a_click(end: Callable[[Mixer, int], None], clicks: bool) -> None:
    """The naive way, dropping it between two blocks, is heard by the same measure."""
    mixer = Mixer(RATE)
    slot = mixer.enter(struck(150.0))
    before = played(mixer, 4096)
    ringing = played(mixer, 2048, first=4096)
    end(mixer, slot)
    after = played(mixer, 4096, first=6144)
    joint = np.concatenate([ringing, after])
    assert np.abs(ringing).max() > 0.02
    assert np.abs(before).max() > 0.05
    assert (_rough(joint) > 3.0 * _rough(ringing)) == clicks
    assert not after[round(0.061 * RATE) + BLOCK :].any()


def test_a_leaving_drum_still_plays_what_it_waits_for() -> None:
    mixer = Mixer(RATE)
    engine = struck(150.0, onset_ns=100_000_000)
    slot = mixer.enter(engine)
    played(mixer, 1024)
    mixer.leave(slot, after_s=0.15)
    sound = played(mixer, 20_480, first=1024)
    assert np.abs(sound[: round(0.07 * RATE)]).max() == 0.0
    assert np.abs(sound[round(0.08 * RATE) :]).max() > 0.05
    assert mixer.buffers.states[slot] == GONE


def test_slots_are_used_again_and_a_seventeenth_drum_is_refused() -> None:
    mixer = Mixer(RATE)
    engine = struck(150.0)
    slots = [mixer.enter(engine) for _ in range(SLOTS)]
    assert sorted(slots) == list(range(SLOTS))
    with pytest.raises(MixerFull, match="16 drums sound already"):
        mixer.enter(engine)
    mixer.leave(slots[3])
    with pytest.raises(MixerFull):
        mixer.enter(engine)  # it still fades
    assert mixer.buffers.states[slots[3]] == LEAVING
    played(mixer, 4096)
    assert mixer.enter(engine) == slots[3]
    assert mixer.buffers.states[slots[3]] == PLAYING
    assert mixer.drums == SLOTS


def test_an_empty_mixer_is_silent() -> None:
    mixer = Mixer(RATE)
    assert not mixer.buffers.states.any()
    assert mixer.buffers.states[0] == EMPTY
    assert not played(mixer, 256, channels=1).any()


def test_a_drum_that_enters_or_leaves_changes_nothing_in_the_sound_of_the_other() -> None:
    mixer, lone = Mixer(RATE), Mixer(RATE)
    silent = Scene("silent", drum=Drum(f01_Hz=210.0))
    for each in (mixer, lone):
        each.enter(struck(150.0))
    parts = [played(mixer, 4 * BLOCK)]
    slot = mixer.enter(build(silent, RATE, StrikeRing()))
    parts.append(played(mixer, 4 * BLOCK, first=4 * BLOCK))
    mixer.leave(slot)
    assert not mixer.has_left(slot)
    parts.append(played(mixer, RATE // 8, first=8 * BLOCK))
    assert mixer.has_left(slot)
    assert mixer.drums == 1
    whole = np.concatenate(parts)
    assert np.array_equal(whole, played(lone, len(whole)))


def snare_of(f01_Hz: float) -> Scene:
    """A second head that hears the others."""
    effects = {"cavity": CavityTable(), "sympathy": SympathyTable(200.0, 0.0)}
    return Scene("snare", drum=Drum(f01_Hz=f01_Hz, effects=effects))


def sympathetic(f01_Hz: float) -> Engine:
    """Its drum, which nobody strikes."""
    return build(snare_of(f01_Hz), RATE, StrikeRing())


def test_a_drum_hears_those_that_hear_none_whichever_came_first() -> None:
    """As offline, where the neighbour's sound is given; by itself, or beside another of its kind, it is silent."""
    neighbour = alone(struck(150.0), 4096)
    offline = neighbour + render(snare_of(210.0), [], 4096 / RATE, RATE, neighbours=neighbour)
    assert np.abs(offline - neighbour).max() > 1e-3
    for order in (True, False):
        mixer = Mixer(RATE)
        for is_struck in (order, not order):
            mixer.enter(struck(150.0) if is_struck else sympathetic(210.0))
        assert played(mixer, 4096) == pytest.approx(offline, abs=1e-6)


def test_two_that_hear_others_do_not_hear_each_other() -> None:
    lone, both = Mixer(RATE), Mixer(RATE)
    for mixer in (lone, both):
        mixer.enter(struck(150.0))
        mixer.enter(sympathetic(210.0))
    both.enter(sympathetic(320.0))
    third = played(both, 4096).astype(float) - played(lone, 4096)
    alone_with_it = Mixer(RATE)
    alone_with_it.enter(struck(150.0))
    alone_with_it.enter(sympathetic(320.0))
    rings = played(alone_with_it, 4096).astype(float) - alone(struck(150.0), 4096)
    assert np.abs(rings).max() > 1e-3
    assert third == pytest.approx(rings, abs=1e-6)
    silent = Mixer(RATE)
    silent.enter(sympathetic(210.0))
    silent.enter(sympathetic(320.0))
    assert not played(silent, 1024).any()


_ENTERS = """
from drumstick.parameters.drum import Drum, Mesh
from drumstick.parameters.scene import Scene
from realtime.kernels.handover import ForeignHandle
from drumstick.drum.build import new_engine
from drumstick.drum.memory.strikes import StrikeRing
from sound_server.mixer import Mixer, _player_of

mixer = Mixer(48_000)
engine = new_engine(Scene("drum", drum=Drum(f01_Hz=150.0)), 48_000, StrikeRing())
print(_player_of(ForeignHandle((engine, mixer.buffers.begun[:1])).kind).was_stored)
"""


@pytest.mark.long
def test_another_process_plays_a_drum_without_compiling() -> None:
    """A sound server that was killed is back before its player would be compiled."""
    found = [
        subprocess.run([sys.executable, "-c", _ENTERS], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert found[1] == "True\n"


def for_two_threads() -> Engine:
    return build(Scene("drum", mesh=Mesh(threads=2)), RATE, StrikeRing())


def second_threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == second_thread.NAME]


@pytest.fixture
def two_cores(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Two cores, and a system that grants real-time priority; no second thread outlives the test."""
    monkeypatch.setattr(second_thread, "cores", lambda: 2)
    monkeypatch.setattr(os, "sched_setscheduler", lambda *_: None)
    second_thread._warn_once.cache_clear()
    yield
    for thread in second_threads():
        thread.join(60.0)
        assert not thread.is_alive()


@pytest.mark.usefixtures("two_cores")
def test_a_drum_for_two_threads_has_its_second_one_until_it_has_faded() -> None:
    mixer, engine = Mixer(RATE), for_two_threads()
    mixer.make_ready(engine)
    assert not second_threads()
    at = mixer.enter(engine)
    (second,) = second_threads()
    mixer.leave(at)
    played(mixer, RATE // 10)
    assert second.is_alive()
    mixer.let_go()
    second.join(60.0)
    assert not second.is_alive()


@pytest.mark.usefixtures("two_cores")
def test_a_drum_that_enters_again_has_a_second_thread_again() -> None:
    mixer, engine = Mixer(RATE), for_two_threads()
    mixer.enter(engine)
    mixer.close()
    for thread in second_threads():
        thread.join(60.0)
    mixer.enter(engine)
    (second,) = second_threads()
    assert second.is_alive()
    mixer.close()


@pytest.mark.usefixtures("two_cores")
def test_on_one_core_a_drum_for_two_threads_plays_on_one_and_says_so_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(second_thread, "cores", lambda: 1)
    mixer = Mixer(RATE)
    for _ in range(2):
        mixer.enter(for_two_threads())
    assert not second_threads()
    assert caplog.text.count("there is only one core") == 1


@pytest.mark.usefixtures("two_cores")
def test_a_second_thread_without_real_time_priority_ends_and_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refused(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    Mixer(RATE).enter(for_two_threads())
    for thread in second_threads():
        thread.join(60.0)
        assert not thread.is_alive()
    assert "may not have real-time priority" in caplog.text


def test_a_drum_of_one_thread_has_no_second_one() -> None:
    mixer = Mixer(RATE)
    mixer.enter(struck(150.0))
    assert not second_threads()
