"""The sound server as a process: strikes over a real router into a WAV file, and everything that may go wrong."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import zenoh
from haptic_side import HapticSide, drum, sounding
from rig_process import PATIENCE_S, wait_for
from wav_heard import RATE, onsets_s, sound_in

from protocol.messages import Cost, Membrane, Message, Spectrum, decode


@pytest.fixture
def side(free_port: Callable[[], int]) -> Iterator[HapticSide]:
    opened = HapticSide(free_port(), drum())
    yield opened
    opened.close()


def test_strikes_become_sound_once_each_and_the_file_is_finished(side: HapticSide, tmp_path: Path) -> None:
    path = tmp_path / "roll.wav"
    with sounding(side.endpoint, f"wav:{path}", tmp_path) as sound:
        side.meter("a sink", lambda m: m.sink == f"wav:{path}")
        assert len(side.alive()) == 1
        for _ in range(5):
            message = side.message()
            side.strike(message)
            side.strike(message)
        side.strike(side.message(side.now_ns() - 60_000_000))
        for rubbish in (b"", b"\xff" * 50, b"[1,2]", message[:-3]):
            side.strike(rubbish)
        # Once each; one is late on purpose, and whatever the machine held up for 50 ms besides.
        meter = side.meter("all strikes", lambda m: m.played + m.late >= 6)
        assert (meter.played + meter.late, meter.duplicates) == (6, 5)
        assert meter.played >= 1 <= meter.late
        assert abs(meter.t_ns - side.now_ns()) < side.ahead_ns // 2  # told in the haptic machine's time
        assert meter.load > 0.0
        assert meter.latency_ms > 0.0
        heard = side.meter("a peak", lambda m: m.peak_left > 0.0)
        assert sound.stop(signal.SIGTERM) == 0
    limited_log = [line for line in sound.lines if line.startswith("WARNING: strike ignored")]
    assert 1 <= len(limited_log) <= 2
    assert [line for line in sound.lines if line not in limited_log] == [
        f"wav:{path} at 48000 Hz: test-drum, mesh of 66.6 junctions across (4033) at 16000 Hz"
    ]
    recorded = sound_in(path)
    assert 0.05 < np.abs(recorded).max() <= 1.0
    assert heard.peak_left <= np.abs(recorded).max() + 1e-3


@pytest.mark.real_clock
def test_a_scene_with_latency_keeps_the_rhythm_of_the_contacts(
    free_port: Callable[[], int], tmp_path: Path
) -> None:
    """Messages come in pairs; what is heard has the intervals that the contacts had.

    All by one estimate of the clock: where others have the processor a newer one, from round trips of some ms, may be
    that much better, and moves what follows (tests/unit/protocol/test_clock.py).
    """
    apart_s = np.array([0.31, 0.27, 0.35, 0.29])
    late, tries = 1, 0
    while late:  # once more where the machine stood still for half a second, and a strike came too late
        tries += 1
        path = tmp_path / f"roll-{tries}.wav"
        side = HapticSide(free_port(), drum(latency_s=0.5, t60_s=0.1))
        try:
            with sounding(side.endpoint, f"wav:{path}", tmp_path) as sound:
                side.meter("a sink", lambda m: bool(m.sink))
                side.keep_clock()
                written = len(sound_in(path))
                start = side.now_ns()
                at_ns = start + np.round(1e9 * np.concatenate([[0.0], np.cumsum(apart_s)])).astype(np.int64)
                for pair in (at_ns[:2], at_ns[2:4], at_ns[4:]):
                    # up to 0.45 s before its contact, or after: only the time in the message counts
                    wait_for(
                        "the pair's turn", lambda side=side, pair=pair: side.now_ns() > pair[0] - 100_000_000
                    )
                    for at in pair:
                        side.strike(side.message(int(at)))
                late = side.meter("all strikes", lambda m: m.played + m.late == 5).late
                # 2.2 s of sound from the first one's time on: a machine that stands still writes it later.
                wait_for(
                    "the last one's end",
                    lambda path=path, written=written: len(sound_in(path)) > written + 2.2 * RATE,
                )
                assert sound.stop(signal.SIGINT) == 0
        finally:
            side.close()
    assert np.diff(onsets_s(sound_in(path), 0.25)) == pytest.approx(apart_s, abs=1e-3)


def test_it_waits_for_a_router_and_returns_to_one_that_went_away(
    free_port: Callable[[], int], tmp_path: Path
) -> None:
    port = free_port()
    with sounding(f"tcp/127.0.0.1:{port}", "null", tmp_path) as sound:
        side = HapticSide(port, drum())
        try:
            side.meter("a sink", lambda m: m.sink == "null")
            side.struck("a strike", lambda m: m.played >= 1)
            side.close()
            side.open()
            side.meter("a sink", lambda m: m.sink == "null")
            assert len(wait_for("presence", side.alive)) == 1
            # Presence may be there before the subscription to strikes is: then the first one is lost.
            side.struck("two strikes", lambda m: m.played >= 2)
            assert sound.stop(signal.SIGTERM) == 0
        finally:
            side.close()
    assert sum("mesh of" in line for line in sound.lines) == 1


@pytest.mark.long
def test_a_servo_that_restarts_with_another_scene_gets_another_drum(side: HapticSide, tmp_path: Path) -> None:
    with sounding(side.endpoint, "null", tmp_path) as sound:
        side.meter("a sink", lambda m: m.sink == "null")
        before = side.struck("a strike", lambda m: m.played >= 1)
        # The same scene, another servo that counts from 1 again, on a machine with another clock.
        side.boot, side.seq, side.ahead_ns = 8, 0, 5_000_000_000
        own = side.struck(
            "its strike",
            lambda m: m.played > before.played and abs(m.t_ns - side.now_ns()) < side.ahead_ns // 2,
        )
        side.boot, side.scene = 9, drum(f01_Hz=300.0)
        side.tell_state()
        sound.said("mesh of 33.3 junctions across")
        side.struck("the new drum's strike", lambda m: m.played > own.played and m.peak_left > 0.0)
        assert sound.stop(signal.SIGTERM) == 0
    assert sum("mesh of" in line for line in sound.lines) == 2


@pytest.mark.long
def test_two_rigs_are_played_by_one_server_each_with_its_own_scene(side: HapticSide, tmp_path: Path) -> None:
    path = tmp_path / "both.wav"
    other = side.another("second", drum(f01_Hz=300.0))
    with sounding(side.endpoint, f"wav:{path}", tmp_path, rigs="main,second,silent") as sound:
        side.meter("a sink", lambda m: bool(m.sink))
        other.meter("a sink", lambda m: bool(m.sink))
        sound.said("rig silent: waiting for the force loop")
        side.struck("its strike", lambda m: m.played >= 1 and m.peak_left > 0.0)
        assert other.meter("no strike", lambda m: True).played == 0
        side.meter("quiet", lambda m: m.peak_left < 1e-4)
        other.struck("its strike", lambda m: m.played >= 1 and m.peak_left > 0.0)
        other.meter("quiet", lambda m: m.peak_left < 1e-4)
        assert sound.stop(signal.SIGTERM) == 0
    recorded = sound_in(path)
    starts = (onsets_s(recorded, 0.25) * RATE).astype(int)
    assert len(starts) >= 2  # one that was thought to be late was struck again
    for start, f01_Hz, elsewhere_Hz in zip(starts[[0, -1]], (150.0, 300.0), (300.0, 150.0), strict=True):
        spectrum = np.abs(np.fft.rfft(recorded[start : start + RATE // 5, 0] * np.hanning(RATE // 5)))
        own, foreign = (spectrum[round(f / 5) - 1 : round(f / 5) + 2].max() for f in (f01_Hz, elsewhere_Hz))
        assert own > 10.0 * foreign


def test_kill_leaves_a_file_that_can_be_read(side: HapticSide, tmp_path: Path) -> None:
    path = tmp_path / "roll.wav"
    with sounding(side.endpoint, f"wav:{path}", tmp_path) as sound:
        side.meter("a sink", lambda m: bool(m.sink))
        side.struck("a sound", lambda m: m.peak_left > 0.01)
        wait_for("a written chunk", lambda: np.abs(sound_in(path)).max(initial=0.0) > 0.01)
        sound.stop(signal.SIGKILL)
    assert np.abs(sound_in(path)).max() > 0.01


@pytest.mark.parametrize("answer", [b"[]", b"{", b'{"drum": {"f01_Hz": 1e9}}', b'{"name": 3, "drum": 4}'])
@pytest.mark.long
def test_a_scene_that_is_none_is_refused_and_asked_for_again(
    answer: bytes, side: HapticSide, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = side._answer_scene
    monkeypatch.setattr("haptic_side.json.dumps", lambda _tables: answer.decode())
    with sounding(side.endpoint, "null", tmp_path) as sound:
        assert sound.said("scene refused").startswith("WARNING: ")
        monkeypatch.undo()
        side.meter("a sink", lambda m: m.sink == "null")
        assert sound.stop(signal.SIGTERM) == 0
    assert good


@pytest.mark.long
def test_stop_while_nobody_answers(free_port: Callable[[], int], tmp_path: Path) -> None:
    path = tmp_path / "roll.wav"
    with sounding(f"tcp/127.0.0.1:{free_port()}", f"wav:{path}", tmp_path) as sound:
        wait_for("the file", path.exists)
        assert sound.stop(signal.SIGTERM) == 0
    assert len(sound_in(path)) == 0


@pytest.mark.parametrize(
    ("audio", "status", "words"),
    [
        ("wav:no/such/folder.wav", 2, "cannot be written"),
        ("wav:", 2, "needs a file name"),
        ("no such loudspeaker", 3, "no audio"),
    ],
)
@pytest.mark.long
def test_what_cannot_be_had_is_one_line_and_a_status(
    audio: str, status: int, words: str, tmp_path: Path, free_port: Callable[[], int]
) -> None:
    with sounding(f"tcp/127.0.0.1:{free_port()}", audio, tmp_path) as sound:
        assert sound.ended() == status
    assert len(sound.lines) == 1
    assert sound.lines[0].startswith("ERROR: ")
    assert words in sound.lines[0]


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ('"rate": 8000', "$.rate"),
        ('"block": "x"', "$.block"),
        ('"rigs": ["a/b"]', "'a/b'"),
        ('"rat": 1', "rat"),
    ],
)
@pytest.mark.long
def test_options_out_of_range_are_a_wrong_request(option: str, words: str) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "sound_server", "{" + option + "}"],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert run.returncode == 2
    assert words in run.stderr.splitlines()[-1]


def test_the_drum_is_shown_to_whoever_subscribes(side: HapticSide, tmp_path: Path) -> None:
    """Its surface in the haptic machine's time, what it sounded, and what its mesh costs."""
    heard: dict[str, list[Message]] = {}
    with sounding(side.endpoint, "null", tmp_path) as sound:
        side.meter("a sink", lambda m: m.sink == "null")
        for key, kind in (
            (side.keys.membrane, Membrane),
            (side.keys.spectrum, Spectrum),
            (side.keys.cost, Cost),
        ):

            def note(sample: zenoh.Sample, kind: type[Message] = kind) -> None:
                heard.setdefault(kind.__name__, []).append(decode(sample.payload.to_bytes(), kind))

            side.session.declare_subscriber(key, note)
        rested = wait_for("a head at rest", lambda: heard.get("Membrane"))[0]
        assert isinstance(rested, Membrane)
        assert not np.frombuffer(rested.heights, "<i2").any()
        assert abs(rested.t_ns - side.now_ns()) < side.ahead_ns // 2

        struck_at = 0.0

        def struck() -> None:
            # Once a second, so that each blow dies away by itself: blows at every look would sound at their own rate.
            nonlocal struck_at
            if time.monotonic() - struck_at > 1.0:
                side.strike()
                struck_at = time.monotonic()

        def moved() -> bool:
            struck()
            return any(m.unit_m > 0.0 for m in heard["Membrane"] if isinstance(m, Membrane))

        wait_for("a head that moves", moved)

        def sounds_at_its_pitch() -> bool:
            # Any spectrum will do: one that was taken while a blow began shows the blow, not the head.
            struck()
            shown = [
                (m.top_Hz, np.frombuffer(m.levels, "<f4"))
                for m in heard.get("Spectrum", [])
                if isinstance(m, Spectrum)
            ]
            loudest = [
                float(np.argmax(levels) / len(levels) * top_Hz)
                for top_Hz, levels in shown
                if levels.max() > -60.0
            ]
            return any(abs(f_Hz - 150.0) < 10.0 for f_Hz in loudest)

        wait_for("a spectrum of the lowest mode", sounds_at_its_pitch)
        costs = wait_for("the costs", lambda: len(heard.get("Cost", [])) >= 4 and heard["Cost"][:4])
        assert [m.accuracy for m in costs if isinstance(m, Cost)] == ["now", "draft", "standard", "fine"]
        assert [round(m.across) for m in costs if isinstance(m, Cost)][:3] == [67, 50, 67]
        assert sound.stop(signal.SIGTERM) == 0
