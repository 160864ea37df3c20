"""The thread that plays a sink is found and scheduled; what a scheduling is called."""

import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from rig.machine import audio_device
from rig.machine.audio_device import (
    UNKNOWN,
    Scheduling,
    audio_thread,
    only_block,
    run_ns,
    schedule,
    scheduling_of,
)
from sound_server import second_thread
from sound_server.sinks.paced import PacedSink
from sound_server.sinks.sink import SinkError

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="threads are told apart on Linux"
)
SCENE = Scene("drum")


@pytest.fixture
def sink() -> Iterator[PacedSink]:
    """One that plays a drum, which was struck."""
    playing = PacedSink("null", 48_000, 128)
    ring = StrikeRing()
    playing.mixer.enter(build(SCENE, 48_000, ring))
    ring.push_blow(full_scale(SCENE))
    yield playing
    playing.close()


def _thread_of(sink: PacedSink) -> threading.Thread:
    # By the sink itself: other tests of this process may have left an audio thread of theirs.
    return vars(sink)["_thread"]


def _play(sink: PacedSink, blocks: int) -> None:
    # Blocks come without anybody's help; the test's own timeout ends a sink that plays none.
    turn = threading.Event()
    while len(sink.blocks) < blocks:
        turn.wait(0.01)


@pytest.fixture
def idle(sink: PacedSink, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """One thread beside the sink's that waits; what other tests' threads do in this process is not told."""
    over = threading.Event()
    waits = threading.Thread(target=over.wait, name="idle")
    waits.start()
    own = {waits.native_id, _thread_of(sink).native_id}
    of_all = run_ns
    monkeypatch.setattr(
        audio_device, "run_ns", lambda: {ident: ns for ident, ns in of_all().items() if ident in own}
    )
    yield
    over.set()
    waits.join()


@pytest.mark.usefixtures("idle")
def test_the_thread_that_plays_is_found(sink: PacedSink) -> None:
    _play(sink, 1)
    found = audio_thread(lambda: _play(sink, 200))
    assert found == _thread_of(sink).native_id
    assert scheduling_of(found) == Scheduling(os.SCHED_OTHER, 0)
    assert threading.get_native_id() not in run_ns()


def test_the_second_thread_of_a_drum_is_not_taken_for_the_audio_thread() -> None:
    over = threading.Event()
    threads = [threading.Thread(target=over.wait, name=name) for name in (second_thread.NAME, "another")]
    for thread in threads:
        thread.start()
    ran = run_ns()
    assert [thread.native_id in ran for thread in threads] == [False, True]
    over.set()
    for thread in threads:
        thread.join()


def test_a_thread_that_came_meanwhile_plays_no_sink(monkeypatch: pytest.MonkeyPatch) -> None:
    told = iter([{1: 100, 2: 100}, {1: 200, 2: 150, 3: 9000}])
    monkeypatch.setattr(audio_device, "run_ns", lambda: next(told))
    assert audio_thread(lambda: None) == 1


@pytest.mark.usefixtures("idle")
def test_a_priority_that_is_refused_changes_nothing(sink: PacedSink, monkeypatch: pytest.MonkeyPatch) -> None:
    _play(sink, 1)
    found = audio_thread(lambda: _play(sink, 200))
    granted = scheduling_of(found)

    def refused(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    assert not schedule(found, granted.other)
    assert scheduling_of(found) == granted


def test_a_thread_that_has_ended_is_told_and_refuses() -> None:
    ended = threading.Thread(target=lambda: None)
    ended.start()
    ended.join()
    assert ended.native_id is not None
    turn = threading.Event()
    while Path(f"/proc/self/task/{ended.native_id}").exists():  # Python is done with it before the system is
        turn.wait(0.001)
    for gone in (ended.native_id, None):
        assert scheduling_of(gone) == UNKNOWN
        assert not schedule(gone, Scheduling(os.SCHED_OTHER, 0))
    assert UNKNOWN.words == "unknown"


def test_jack_without_its_library_is_refused_in_words_and_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[str] = []

    class Playing:
        description = "system (JACK Audio Connection Kit)"

        def close(self) -> None:
            closed.append(self.description)

    def missing(_: str) -> None:
        raise OSError("libjack.so.0: cannot open shared object file")

    monkeypatch.setattr(audio_device, "open_sink", lambda *_, **__: Playing())
    monkeypatch.setattr(audio_device.ctypes, "CDLL", missing)
    with pytest.raises(SinkError, match="its library does not load"):
        only_block("auto", 48_000)
    assert len(closed) == 1


@pytest.mark.parametrize(
    ("policy", "priority", "words"),
    [
        (os.SCHED_OTHER, 0, "ordinary"),
        (os.SCHED_FIFO, 5, "SCHED_FIFO 5"),
        (os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, 65, "SCHED_FIFO 65"),  # as JACK and rtkit ask for it
        (os.SCHED_RR | os.SCHED_RESET_ON_FORK, 20, "SCHED_RR 20"),
    ],
)
def test_words_of_a_scheduling(policy: int, priority: int, words: str) -> None:
    assert Scheduling(policy, priority).words == words


def test_a_device_that_is_not_there() -> None:
    with pytest.raises(SinkError, match="no audio"):
        only_block("no such device", 48_000)
