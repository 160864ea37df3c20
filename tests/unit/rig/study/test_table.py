"""The tables of a study, from a log of which everything is known."""

import csv
import math
from pathlib import Path

import msgspec
import pytest

from drumstick.analysis.timing import Timing
from rig.exit_status import CommandError
from rig.study import commands, table
from rig.study.session_log import Attempt, Begin, Click, End, Session, SessionLog, Strike
from rig.study.task import Block, Task

MS = 1_000_000
FIRST_NS = 10**15  # eleven days after the machine's start
STOPS = Block(
    name="tap",
    condition="a pad",
    source="midi",
    rate_Hz=2.0,
    strikes=6,
    metronome="stops",
    sounded=3,
    count_in=1,
)
ROLL = Block(
    name="roll", condition="stick", rate_Hz=2.0, strikes=4, metronome="throughout", every=2, count_in=0
)
FREE = Block(name="free", condition="the stick", duration_s=2.0)
HEAD = Session("p01", 3, "2026-01-01T00:00:00+00:00", "main", "0", Task(name="t", block=[STOPS, FREE]))


def strike(at_ms: float, *, counts: bool = True, level: float = 0.5) -> Strike:
    return Strike(FIRST_NS + round(at_ms * MS), 0.0, 0.1, level, 1.0, "midi", counts)


def click(beat: int, late_ms: float) -> Click:
    due_ns = FIRST_NS + beat * 500 * MS
    return Click(beat, due_ns, due_ns + round(late_ms * MS))


def tapped() -> Attempt:
    """Each click 2 ms late; strikes 10, 20 and 30 ms before it, then intervals of 500, 520, 510 ms."""
    clicks = [click(beat, 2.0) for beat in range(-1, 3)]
    at_ms = [-500.0, -8.0, 482.0, 972.0, 1472.0, 1992.0, 2502.0, 3100.0]
    strikes = [*(strike(each) for each in at_ms), strike(700.0, counts=False)]
    return Attempt(Begin(1, 1, FIRST_NS, "roll"), clicks, strikes, End(1, 0, 0, 1.5, 12.0))


def test_a_block_of_two_phases() -> None:
    first, second = table.block_rows(HEAD, [tapped()])
    assert (first["phase"], second["phase"]) == ("synchronisation", "continuation")
    assert (first["strikes"], first["misses"], first["extras"]) == (3, 0, 0)
    assert first["asynchrony_mean_ms"] == pytest.approx(-20.0)
    assert first["asynchrony_sd_ms"] == pytest.approx(10.0)
    assert first["click_late_worst_ms"] == pytest.approx(2.0)
    assert (first["arrival_ms"], first["output_latency_ms"], first["whole"]) == (1.5, 12.0, True)
    assert (second["strikes"], second["intervals"], second["misses"]) == (
        3,
        2,
        pytest.approx(math.nan, nan_ok=True),
    )
    assert second["interval_mean_ms"] == pytest.approx(515.0)
    assert set(first) == set(table.BLOCK_COLUMNS)


def test_each_strike_has_its_row() -> None:
    rows = [*table.strike_rows(HEAD, [tapped()])]
    assert [row["phase"] for row in rows] == [
        "count_in", "synchronisation", "synchronisation", "synchronisation", "synchronisation",
        "continuation", "continuation", "continuation", "after",
    ]  # fmt: skip
    assert [row["counts"] for row in rows].count(False) == 1
    told = [(row["beat"], row["asynchrony_ms"]) for row in rows if row.get("beat")]
    assert told == [(beat, pytest.approx(wanted)) for beat, wanted in ((1, -10.0), (2, -20.0), (3, -30.0))]
    intervals = [row["interval_ms"] for row in rows if row.get("interval_ms") is not None]
    assert intervals == pytest.approx([490.0, 490.0, 520.0, 510.0])
    assert rows[1]["t_s"] == pytest.approx(-0.008)
    assert {name for row in rows for name in row} == set(table.STRIKE_COLUMNS)


def test_a_beat_between_two_clicks_is_as_late_as_they_are() -> None:
    head = Session("p01", 1, "", "main", "0", Task(name="t", block=[ROLL]))
    attempt = Attempt(
        Begin(1, 1, FIRST_NS, "roll"), [click(0, 2.0), click(2, 4.0)],
        [strike(each) for each in (2.0, 503.0, 1004.0, 1504.0)], End(1, 0, 0),
    )  # fmt: skip
    (row,) = table.block_rows(head, [attempt])
    assert row["asynchrony_mean_ms"] == pytest.approx(0.0, abs=1e-9)
    assert row["asynchrony_sd_ms"] == pytest.approx(0.0, abs=1e-9)


def test_a_free_block_and_one_that_was_left_off() -> None:
    strikes = [strike(each) for each in (-1.0, 0.0, 40.0, 1999.0, 2000.0)]
    whole = Attempt(Begin(2, 2, FIRST_NS, "roll"), [], strikes, End(2, 0, 0))
    (row,) = table.block_rows(HEAD, [whole])
    assert (row["phase"], row["strikes"], row["target_interval_ms"]) == ("free", 3, None)
    assert row["odd_intervals"] == 0
    (row,) = table.block_rows(HEAD, [Attempt(whole.begin, [], strikes)])
    assert (row["whole"], row.get("strikes")) == (False, None)


def test_every_column_of_a_quantity_has_its_unit() -> None:
    bare = {
        *(
            "strikes",
            "misses",
            "extras",
            "intervals",
            "odd_intervals",
            "lost",
            "beat",
            "level",
            "level_mean",
            "x",
            "y",
        ),
        *("interval_variation", "interval_lag1", "npvi", "level_variation", "speed_variation", "metronome"),
        *("source", "counts", "player", "session", "begun_at", "task", "block", "block_name", "condition"),
        *("attempt", "whole", "scene", "phase"),
    }
    units = ("_ms", "_s", "_Hz", "_m_per_s")
    for name in {*table.STRIKE_COLUMNS, *table.BLOCK_COLUMNS} - bare:
        assert name.endswith(units), name
    assert {*Timing.__dataclass_fields__} <= {*table.BLOCK_COLUMNS}


def test_a_file_is_replaced_whole_and_is_ones_own(tmp_path: Path) -> None:
    out = tmp_path / "study.csv"
    out.write_text("before", encoding="utf-8")
    table.write(
        out, ("a_s", "b", "c", "d"), [{"a_s": 1e-9, "b": math.nan, "c": 'x, "y"', "d": True}, {"a_s": 2.5}]
    )
    with out.open(encoding="utf-8", newline="") as file:
        assert [*csv.reader(file)] == [
            ["a_s", "b", "c", "d"],
            ["1e-09", "", 'x, "y"', "true"],
            ["2.5", "", "", ""],
        ]
    assert out.stat().st_mode & 0o777 == 0o600
    assert [path.name for path in tmp_path.iterdir()] == ["study.csv"]


def test_a_log_that_was_never_begun_is_in_nobodys_way(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    SessionLog(tmp_path, HEAD).close()
    (tmp_path / "p01" / "session-004.jsonl").touch()
    commands.export(tmp_path, tmp_path / "study.csv")
    assert "1 sessions" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("folder", "out", "words"),
    [
        ("none", "study.csv", "none: there is no such folder"),
        ("", "study.txt", r"a table's name ends in \.csv"),
        ("", "none/study.csv", "there is no folder"),
        ("", "study.csv", "no player's folder with a session in it"),
    ],
)
def test_what_cannot_be_exported_is_said(tmp_path: Path, folder: str, out: str, words: str) -> None:
    with pytest.raises(CommandError, match=words):
        commands.export(tmp_path / folder, tmp_path / out)


def test_a_click_that_is_late_by_more_than_an_interval_leaves_the_beats_in_order() -> None:
    """The second of two clicks, ten beats of 50 ms after the first, is 60 ms late: the beats between share that."""
    fast = msgspec.structs.replace(ROLL, name="fast", rate_Hz=20.0, strikes=30, every=10)
    clicks = [Click(beat, FIRST_NS + beat * 50 * MS, FIRST_NS + (beat * 50 + late) * MS) for beat, late in
              ((0, 0), (10, 60), (20, 0))]  # fmt: skip
    attempt = Attempt(
        Begin(1, 1, FIRST_NS, "roll"), clicks, [strike(0.0), strike(56.0)], End(1, 0, 0, 1.5, 12.0)
    )
    (phase,) = table.phases(attempt, fast)
    assert phase.beats_s[:2] == pytest.approx([0.0, 0.056])
    assert phase.beats_s[10:12] == pytest.approx([0.56, 0.604])
    assert phase.beats_s[29] == pytest.approx(1.0 + 9 * 0.05)
    head = Session("p01", 3, "2026-01-01T00:00:00+00:00", "main", "0", Task(name="t", block=[fast]))
    (row,) = table.block_rows(head, [attempt])
    assert row["misses"] == 28
