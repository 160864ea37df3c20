"""The index of a recording's chunks: not in memory while it grows, and in the file all the same."""

import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from protocol.messages import Release
from rig.recording import channels
from rig.recording.index import keep_on_disk
from rig.recording.mcap_writer import McapWriter

SECOND_NS = 10**9


def recorded(path: Path, chunks: int) -> McapWriter:
    mcap = McapWriter(path, {"rig": "test"})
    for second in range(chunks):
        for half in range(2):
            now_ns = second * SECOND_NS + half * SECOND_NS
            release = Release(
                boot=1, seq=second, t_ns=now_ns, exit_speed_m_per_s=1.0, impulse_N_s=0.1, peak_N=1.0, contact_s=0.01
            )  # fmt: skip
            mcap.put(channels.RELEASE, "", release, now_ns, now_ns, now_ns)
    return mcap


def test_the_finished_file_has_the_whole_index(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    mcap = recorded(path, 300)
    mcap.finish()
    with path.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count >= 300
        starts = [index.chunk_start_offset for index in summary.chunk_indexes]
        assert starts == sorted(set(starts))
        assert all(index.message_index_offsets for index in summary.chunk_indexes)
        # Which only a whole index makes possible: a piece out of the middle.
        piece = list(reader.iter_messages(starting_at=100 * SECOND_NS, ending_before=110 * SECOND_NS))
    assert 18 <= len(piece) <= 22
    assert [entry.name for entry in tmp_path.iterdir()] == ["take.mcap"], "the index's own file has no name"


def test_a_longer_recording_needs_no_more_memory(tmp_path: Path) -> None:
    blocks: list[int] = []
    mcap = recorded(tmp_path / "warm.mcap", 50)
    for count in (100, 600):
        other = recorded(tmp_path / f"{count}.mcap", count)
        blocks.append(sys.getallocatedblocks())
        other.abandon()
    mcap.abandon()
    # mcap's own list keeps about ten objects for each chunk.
    assert blocks[1] - blocks[0] < 1000


def test_another_mcap_is_refused_rather_than_left_to_grow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (tmp_path / "x").open("wb") as stream:
        writer = Writer(stream)
        monkeypatch.delattr(writer, "_Writer__chunk_indices")
        with pytest.raises(RuntimeError, match="memory"):
            keep_on_disk(writer, tmp_path)
