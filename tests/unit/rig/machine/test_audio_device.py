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
from rig.machine.audio_device import UNKNOWN, NullSink, Scheduling, audio_thread, only_block, opened, run_ns
from sound_server.sinks.sink import SinkError

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="threads are told apart on Linux"
)
SCENE = Scene("drum")


@pytest.fixture
def sink() -> Iterator[NullSink]:
    """One that plays a drum, which was struck."""
    playing = NullSink(48_000, 128)
    ring = StrikeRing()
    playing.mixer.enter(build(SCENE, 48_000, ring))
    ring.push_blow(full_scale(SCENE))
    yield playing
    playing.close()


def _thread_of(sink: NullSink) -> threading.Thread:
    # By the sink itself: other tests of this process may have left an audio thread of theirs.
    return vars(sink)["_thread"]


def _play(sink: NullSink, blocks: int) -> None:
    # Blocks come without anybody's help; the test's own timeout ends a sink that plays none.
    turn = threading.Event()
    while len(sink.blocks) < blocks:
        turn.wait(0.01)


@pytest.fixture
def idle(sink: NullSink, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
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
def test_the_thread_that_plays_is_found(sink: NullSink) -> None:
    _play(sink, 1)
    before = run_ns()
    _play(sink, 200)
    found = audio_thread(before)
    assert found is not None
    assert found.ident == _thread_of(sink).native_id
    assert found.granted == Scheduling(os.SCHED_OTHER, 0)
    assert threading.get_native_id() not in before


@pytest.mark.usefixtures("idle")
def test_a_priority_that_is_refused_changes_nothing(sink: NullSink, monkeypatch: pytest.MonkeyPatch) -> None:
    _play(sink, 1)
    before = run_ns()
    _play(sink, 200)
    found = audio_thread(before)
    assert found is not None

    def refused(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    assert not found.set(found.other())
    assert found.now() == found.granted


def test_a_thread_that_has_ended_is_told_and_refuses(sink: NullSink) -> None:
    _play(sink, 200)
    found = audio_thread({})
    assert found is not None
    ended = threading.Thread(target=lambda: None)
    ended.start()
    ended.join()
    assert ended.native_id is not None
    turn = threading.Event()
    while Path(f"/proc/self/task/{ended.native_id}").exists():  # Python is done with it before the system is
        turn.wait(0.001)
    found.ident = ended.native_id
    assert found.words == UNKNOWN
    assert not found.set(found.other())


def test_jack_without_its_library_is_refused_in_words_and_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[str] = []

    class Playing:
        description = "system (JACK Audio Connection Kit)"

        def close(self) -> None:
            closed.append(self.description)

    def missing(_: str) -> None:
        raise OSError("libjack.so.0: cannot open shared object file")

    monkeypatch.setattr(audio_device, "open_sink", lambda *_, **__: Playing())
    monkeypatch.setattr(audio_device, "DeviceSink", Playing)
    monkeypatch.setattr(audio_device.ctypes, "CDLL", missing)
    with pytest.raises(SinkError, match="its library does not load"):
        opened("auto", 48_000, 128)
    with pytest.raises(SinkError, match="its library does not load"):
        only_block("auto", 48_000)
    assert len(closed) == 2


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
    assert Scheduling(policy, priority).real_time == (words != "ordinary")


def test_a_device_that_is_not_there() -> None:
    with pytest.raises(SinkError, match="no audio"):
        opened("no such device", 48_000, 32)
