"""A session's log: nothing that was written is lost, what is half written is cut, and nobody's name is taken."""

import os
from pathlib import Path

import pytest

from rig.exit_status import CommandError
from rig.study import session_log
from rig.study.session_log import Begin, Click, End, Session, SessionLog, Strike
from rig.study.task import Block, Task

TASK = Task(name="t", block=[Block(name=name, condition="pad", duration_s=1.0) for name in ("a", "b")])
OTHER = Task(name="other", block=TASK.block)
STRIKE = Strike(2, 0.0, 0.1, 0.5, 1.0, "osc", True)


def head(task: Task = TASK, session: int = 1) -> Session:
    return Session("p01", session, "2026-01-01T00:00:00+00:00", "main", "0", task)


def played(folder: Path, *blocks: int, whole: bool = True, session: int = 1) -> Path:
    log = SessionLog(folder, head(session=session))
    for block in blocks:
        log.write(Begin(block, log.next_attempt(block), 1, "roll"))
        log.write(STRIKE)
        if whole:
            log.write(End(block, 0, 0))
            log.sync()
    log.close()
    return log.path


def test_it_comes_back_as_it_was(tmp_path: Path) -> None:
    path = played(tmp_path, 1)
    with path.open("ab") as file:
        file.write(b'{"type":"block","block":2,"attempt":1,"first_ns":7,"scene":"roll"}\n')
        file.write(b'{"type":"click","strike":-1,"due_ns":3,"t_ns":4}\n')
    first, second = session_log.read(path)[1]
    assert (session_log.read(path)[0], first.strikes, first.end) == (head(), [STRIKE], End(1, 0, 0))
    assert (second.begin, second.clicks, second.end) == (Begin(2, 1, 7, "roll"), [Click(-1, 3, 4)], None)
    assert [path.stat().st_mode & 0o777, path.parent.stat().st_mode & 0o777] == [0o600, 0o700]


@pytest.mark.parametrize("cut", range(1, 60, 7))
def test_half_a_line_is_cut_and_the_rest_goes_on(tmp_path: Path, cut: int) -> None:
    path = played(tmp_path, 1, 2)
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    log = SessionLog(tmp_path, head())
    assert log.whole == {1}
    assert log.next_attempt(2) == 2
    log.close()
    kept = path.read_bytes()
    assert kept.endswith(b"\n")
    assert whole.startswith(kept)
    assert session_log.read(path)[1][0].end is not None


def test_a_log_without_a_whole_line_begins_anew(tmp_path: Path) -> None:
    path = played(tmp_path)
    path.write_bytes(path.read_bytes()[:10])
    assert session_log.next_session(tmp_path, "p01") == 1
    SessionLog(tmp_path, head()).close()
    assert session_log.read(path) == (head(), [])


def test_the_session_that_was_left_off_comes_before_the_next(tmp_path: Path) -> None:
    assert session_log.next_session(tmp_path, "p01") == 1
    played(tmp_path, 1)
    assert session_log.next_session(tmp_path, "p01") == 1
    played(tmp_path, 2, whole=False)
    assert session_log.next_session(tmp_path, "p01") == 1
    played(tmp_path, 2)
    assert session_log.next_session(tmp_path, "p01") == 2
    assert session_log.next_session(tmp_path, "p02") == 1


def test_another_task_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    path = played(tmp_path, 1)
    before = path.read_bytes()
    with pytest.raises(CommandError, match="session 1 of p01 was begun with another task, 't'"):
        SessionLog(tmp_path, head(OTHER))
    assert path.read_bytes() == before


def test_two_at_once_are_refused(tmp_path: Path) -> None:
    log = SessionLog(tmp_path, head())
    with pytest.raises(CommandError, match="another `drumstick study run` writes it"):
        SessionLog(tmp_path, head())
    log.close()
    SessionLog(tmp_path, head()).close()


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (b"rubbish\n", "line 1: no record of a study"),
        (b'{"type":"click","strike":1,"due_ns":3,"t_ns":4}\n', "line 1: a log begins with its session"),
        (b"", "holds no session"),
    ],
)
def test_what_is_no_log_is_said(tmp_path: Path, lines: bytes, words: str) -> None:
    path = tmp_path / "session-001.jsonl"
    path.write_bytes(lines)
    with pytest.raises(CommandError, match=words):
        session_log.read(path)


def test_a_strike_outside_of_a_block_and_a_second_head_are_no_log(tmp_path: Path) -> None:
    path = played(tmp_path, 1)
    with path.open("ab") as file:
        file.write(b'{"type":"click","strike":1,"due_ns":3,"t_ns":4}\n')
    with pytest.raises(CommandError, match="line 5: belongs to no block"):
        session_log.read(path)
    path.write_bytes(path.read_bytes().splitlines(keepends=True)[0] * 2)
    with pytest.raises(CommandError, match="line 2: a log begins with its session, and has one"):
        session_log.read(path)


@pytest.mark.parametrize("player", ["Ada", "p", "01", "../p01", "adalovelace1", "p01/..", ""])
def test_a_name_is_no_pseudonym(player: str, tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="one to three letters and a number"):
        session_log.checked_player(player)
    with pytest.raises(CommandError, match="one to three letters and a number"):
        session_log.forget(tmp_path, player)


def test_one_player_is_forgotten_and_only_that_one(tmp_path: Path) -> None:
    played(tmp_path, 1, 2)
    played(tmp_path, 1, session=2)
    (tmp_path / "p02").mkdir()
    (tmp_path / "p03").symlink_to(tmp_path / "p02")
    assert session_log.forget(tmp_path, "p01") == 2
    assert sorted(os.listdir(tmp_path)) == ["p02", "p03"]
    for player in ("p01", "p03"):
        with pytest.raises(CommandError, match="there is no folder of this player"):
            session_log.forget(tmp_path, player)
