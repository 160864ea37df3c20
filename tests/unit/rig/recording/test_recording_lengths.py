"""A recording or a table with one bad time, or one bad count: refused with the reason before anything is written."""

import json
import shutil
from pathlib import Path
from typing import NamedTuple

import msgspec
import pytest

from protocol.keys import Keys
from protocol.messages import Contact, Message, Strike
from recordings import START_NS, a_state, a_strike, channel, made
from rig.exit_status import GIVEN, LACKING, CommandError
from rig.offline import render as rendering
from rig.recording import reading
from rig.recording.mcap_writer import SCENE_ATTACHMENT, McapWriter
from rig.recording.reading import RecordingError, read
from rig.replaying import replay as replaying
from sound_server.sinks import wavfile

YEARS_S = 1e9


def piece(seq: int = 1, tick: int = 1, rate_Hz: float = 1000.0) -> Contact:
    return Contact(boot=7, seq=seq, first_tick=tick, rate_Hz=rate_Hz, forces=b"\0\0\x80?", t_ns=1)


def rendered(out: Path, scene: str = "bare-drum", **options: object) -> None:
    given = {"out": out, "duration_s": 0.2, "strikes": None, "roll": False, "rate_Hz": 48_000, **options}
    rendering.render(scene, rendering.RenderOptions(**given), as_json=True, whole="duration_s" not in options)


def test_one_time_far_away_fills_no_disk(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.wav"
    path = made(tmp_path / "a.mcap", [(0.0, "/strike", a_strike(1)), (YEARS_S, "/strike", a_strike(2))])
    with pytest.raises(
        CommandError, match=r"lasts 1e\+09 s, 1.92e\+05 GB of sound.*--duration SECONDS"
    ) as stop:
        rendered(out, strikes=path)
    assert stop.value.status == GIVEN
    assert not out.exists()
    rendered(out, strikes=path, duration_s=0.2)
    assert json.loads(capsys.readouterr().out)["strikes"] == 1


def test_nor_does_a_duration_that_no_wav_file_or_disk_can_hold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "a.wav"
    with pytest.raises(CommandError, match=r"100000 s are 19.2 GB; a WAV file holds 4.29 GB") as stop:
        rendered(out, duration_s=100_000.0)
    assert stop.value.status == GIVEN

    class _Usage(NamedTuple):
        free: int

    monkeypatch.setattr(shutil, "disk_usage", lambda _folder: _Usage(38_000))
    with pytest.raises(CommandError, match=r"the disk has room for 3.8e-05 GB") as stop:
        rendered(out, duration_s=0.2)
    assert stop.value.status == LACKING
    assert not out.exists()
    out.write_bytes(bytes(1000))  # what is replaced makes room
    rendered(out, duration_s=0.2)


def test_a_wav_file_ends_where_its_header_can_tell_no_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import numpy as np

    monkeypatch.setattr(wavfile, "MAX_BYTES", 400)
    wav = wavfile.WavFile(tmp_path / "a.wav", 48_000, longest_s=1e9)
    wav.record(np.zeros((500, 2), np.float32))
    assert not wav.is_open
    assert (tmp_path / "a.wav").stat().st_size == 444


def test_strikes_whose_times_go_back_are_refused_with_their_line(tmp_path: Path) -> None:
    table = tmp_path / "strikes.csv"
    table.write_text("t_s,x,y,speed_m_per_s\n0.1,0.5,0,1.0\n0.3,0,0,1\n0.2,0,0,1\n")
    with pytest.raises(CommandError, match=r"strikes\.csv:4: t_s goes back: 0.2 s after 0.3 s"):
        rendered(tmp_path / "a.wav", strikes=table)


def _timed(path: Path, times_s: list[tuple[float, float]]) -> Path:
    # Strikes by when they were recorded and when they happened.
    mcap = McapWriter(path, {"rig": "main", "boot": "7"}, lambda _name: "")
    for seq, (log_s, publish_s) in enumerate(times_s):
        log_ns, publish_ns = (START_NS + round(t * 1e9) for t in (log_s, publish_s))
        mcap.put(*channel("/strike"), a_strike(seq), log_ns, publish_ns, 0)
    mcap.finish()
    return path


@pytest.mark.parametrize(
    ("times_s", "words"),
    [
        ([(9.0, 9.0), (5.0, 5.0)], "message 2, on /strike: its time goes back: it was recorded 4 s before"),
        ([(0.0, 0.0), (1.0, 9.0)], "message 2, on /strike: its times do not fit: it happened 8 s after"),
        ([(0.0, 0.0), (1.0, -4999.0)], "it happened 5000 s before it was recorded"),
    ],
)
def test_messages_whose_times_no_recorder_writes(
    tmp_path: Path, times_s: list[tuple[float, float]], words: str
) -> None:
    with pytest.raises(RecordingError, match=words):
        read(_timed(tmp_path / "a.mcap", times_s))


def test_what_was_under_way_for_a_while_is_played(tmp_path: Path) -> None:
    assert len(read(_timed(tmp_path / "a.mcap", [(9.0, 9.0), (8.0, 7.0), (70.0, 10.0)])).events) == 3


def test_messages_that_would_fill_the_memory_are_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A few kilobytes of a compressed file may hold as many megabytes of words."""
    words = "x" * 1_000_000
    path = made(tmp_path / "a.mcap", [(0.1 * k, "/state", a_state(k, status=words)) for k in range(5)])
    assert path.stat().st_size < 100_000
    monkeypatch.setattr(reading, "_MAX_BYTES", 3_000_000)
    with pytest.raises(RecordingError, match="more than 3000000 bytes of messages"):
        read(path)


def _numbered(seq: int) -> Strike:
    return msgspec.structs.replace(a_strike(1), seq=seq)


def replayed(path: Path) -> None:
    options = replaying.ReplayOptions(
        path, 1.0, False, False, "tcp/127.0.0.1:7447", None, (), "/drumstick", 3600.0
    )
    replaying.replay(Keys("main"), replaying.checked(options), as_json=True)


def test_a_replay_of_years_is_refused_and_its_silence_named(tmp_path: Path) -> None:
    messages: list[tuple[float, str, Message]] = [
        (at, "/strike", a_strike(k)) for k, at in enumerate((0, 2, YEARS_S))
    ]
    path = made(tmp_path / "a.mcap", messages)
    with pytest.raises(
        CommandError,
        match=r"play for 1e\+09 s, 1e\+09 s of it in silence after the first 2 s.*--longest 100000000",
    ):
        replayed(path)


@pytest.mark.parametrize(
    ("messages", "words"),
    [
        ([_numbered(2**60)], "no servo counts to"),
        ([a_strike(1), _numbered(2**50)], "gaps of many millions"),
        ([a_strike(1), a_state(2**62)], "/state: no servo counts to"),
        ([a_strike(1), piece(tick=2**60)], "/contact: no servo counts to"),
        ([a_strike(1), piece(rate_Hz=1e308)], r"a contact of 1e\+308 ticks a second"),
        ([a_strike(1), piece(rate_Hz=-1.0)], "a contact of -1 ticks a second"),
    ],
)
def test_numbers_that_would_not_go_into_a_message_again_are_refused_before_it_plays(
    tmp_path: Path, messages: list[Message], words: str
) -> None:
    told = [(0.1 * k, f"/{type(m).__name__.lower()}", m) for k, m in enumerate(messages)]
    with pytest.raises(CommandError, match=words):
        replayed(made(tmp_path / "a.mcap", told))


@pytest.mark.parametrize(
    "scene",
    [b"[" * 200_000, b'{"name":' + b"9" * 5000 + b"}", msgspec.json.encode({"stick": {"m_kg": 10**400}})],
)
def test_a_scene_in_a_recording_that_is_none(tmp_path: Path, scene: bytes) -> None:
    mcap = McapWriter(tmp_path / "a.mcap", {"rig": "main", "boot": "7"}, lambda _name: "")
    mcap.attach_scene(SCENE_ATTACHMENT, scene, START_NS)
    mcap.put(*channel("/strike"), a_strike(1), START_NS, START_NS, 0)
    mcap.finish()
    with pytest.raises(CommandError, match="its scene cannot be read"):
        replayed(tmp_path / "a.mcap")
