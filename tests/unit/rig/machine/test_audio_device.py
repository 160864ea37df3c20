"""The thread that plays a sink is found and scheduled; what a scheduling is called."""

import os
import sys
import threading
from collections.abc import Iterator

import pytest

from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from rig.machine import audio_device
from rig.machine.audio_device import NullSink, Scheduling, audio_thread, opened, run_ns
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
    own = {each.native_id for each in threading.enumerate() if each.name in ("audio", "idle")}
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
    own = next(thread for thread in threading.enumerate() if thread.name == "audio")
    assert found.ident == own.native_id
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
