"""A session's log: one JSON object a line, appended as it happens, on the disk at each block's end.

A program that is killed loses nothing that it wrote; a power cut at most the present block, which is played again.
Each player has a folder of his own, 0700, each session a file, 0600. One process at a time; POSIX only.
"""

import errno
import os
import re
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import msgspec
from msgspec import Struct

from realtime.regular_file import read_bytes
from rig.exit_status import unavailable, usage_error
from rig.study.task import Task

if sys.platform != "win32":
    import fcntl

FORMAT = 1
_MAX_BYTES = 1_000_000_000
_PLAYER = re.compile(r"[A-Za-z]{1,3}[0-9]{1,4}")
_SESSION = re.compile(r"session-(\d{3})\.jsonl")
MAX_SESSION = 999


class Session(Struct, frozen=True, tag="session"):
    """First line: who plays what, when, on which rig. `begun_at`: local time with its offset, ISO 8601."""

    player: str
    session: int
    begun_at: str
    rig: str
    version: str
    task: Task
    format: int = FORMAT


class Begin(Struct, frozen=True, tag="block"):
    """Begin of a block, counted from 1. `first_ns`: due time of its first strike; scene: what the rig played."""

    block: int
    attempt: int
    first_ns: int
    scene: str


class Click(Struct, frozen=True, tag="click"):
    """A click of the metronome, for this strike of the block (below 0: count-in): when it was due, when it came."""

    strike: int
    due_ns: int
    t_ns: int


class Strike(Struct, frozen=True, tag="strike"):
    """A strike of anybody but the metronome. `source`: the way that it came; `counts`: it is of the block's source."""

    t_ns: int
    x: float
    y: float
    level: float
    speed_m_per_s: float
    source: str
    counts: bool


class End(Struct, frozen=True, tag="end"):
    """End of a block that is whole. `lost`: strikes that never came; `unreadable`: messages that held nonsense.

    arrival_ms, output_latency_ms: what the sound server said last of itself; None without one.
    """

    block: int
    lost: int
    unreadable: int
    arrival_ms: float | None = None
    output_latency_ms: float | None = None


Record = Session | Begin | Click | Strike | End


@dataclass
class Attempt:
    """A block as it was played once; without `end` it was left off."""

    begin: Begin
    clicks: list[Click] = field(default_factory=list[Click])
    strikes: list[Strike] = field(default_factory=list[Strike])
    end: End | None = None


def checked_player(player: str) -> str:
    """The pseudonym, if it is one that hardly any name can be; else CommandError."""
    if not _PLAYER.fullmatch(player):
        usage_error(
            f"--player {player!r}: give a pseudonym of one to three letters and a number, e.g. p07; no names"
        )
    return player


def sessions(folder: Path, player: str) -> dict[int, Path]:
    """Files of a player's sessions by their numbers, in order."""
    found = ((_SESSION.fullmatch(path.name), path) for path in (folder / player).glob("session-*.jsonl"))
    return dict(sorted((int(name[1]), path) for name, path in found if name))


def players(folder: Path) -> list[str]:
    """Players who have a folder here, in order. Raises CommandError where there is no such folder."""
    if not folder.is_dir():
        usage_error(f"{folder}: there is no such folder")
    return sorted(path.name for path in folder.iterdir() if path.is_dir() and _PLAYER.fullmatch(path.name))


def read(path: Path) -> tuple[Session, list[Attempt]]:
    """A session's log. A last line that was not written to its end is left out. Raises CommandError."""
    try:
        content = read_bytes(path, _MAX_BYTES)
    except OSError as error:
        unavailable(f"{path}: cannot be read: {error.strerror}")
    return _parsed(path, content)


def _parsed(path: Path, content: bytes) -> tuple[Session, list[Attempt]]:
    head: Session | None = None
    attempts: list[Attempt] = []
    for number, line in enumerate(content.split(b"\n")[:-1], 1):
        try:
            record: Record = msgspec.json.decode(line, type=Record)
        except (msgspec.MsgspecError, UnicodeDecodeError) as error:
            usage_error(f"{path}, line {number}: no record of a study: {error}")
        if (head is None) != isinstance(record, Session):
            usage_error(f"{path}, line {number}: a log begins with its session, and has one")
        match record:
            case Session():
                head = record
            case Begin():
                attempts.append(Attempt(record))
            case _ if not attempts or attempts[-1].end is not None:
                usage_error(f"{path}, line {number}: belongs to no block")
            case Click():
                attempts[-1].clicks.append(record)
            case Strike():
                attempts[-1].strikes.append(record)
            case End():
                attempts[-1].end = record
    if head is None:
        usage_error(f"{path}: holds no session")
    if head.format != FORMAT:
        usage_error(f"{path}: has format {head.format}, this program reads {FORMAT}")
    return head, attempts


def next_session(folder: Path, player: str) -> int:
    """Number of the session that was left off, or of the next one. Raises CommandError."""
    known = sessions(folder, player)
    if not known:
        return 1
    last, path = list(known.items())[-1]
    if is_empty(path):
        return last
    head, attempts = read(path)
    return last if whole_blocks(attempts) != set(range(1, len(head.task.block) + 1)) else last + 1


def is_empty(path: Path) -> bool:
    """True for a log that was made and not begun: its program was killed in between. Raises OSError."""
    return _whole_lines(path) == b""


def _whole_lines(path: Path) -> bytes:
    content = read_bytes(path, _MAX_BYTES)
    return content[: content.rfind(b"\n") + 1]


def whole_blocks(attempts: Sequence[Attempt]) -> set[int]:
    """Numbers of the blocks that were played to their end."""
    return {each.begin.block for each in attempts if each.end is not None}


class SessionLog:
    """An open log. `whole`: blocks that it has from an earlier run. Methods raise OSError when the disk is full."""

    def __init__(self, folder: Path, head: Session) -> None:
        """Open the log of this session, or make it. Raises CommandError, also when it has another task."""
        home = folder / head.player
        home.mkdir(mode=0o700, parents=True, exist_ok=True)
        self.path = home / f"session-{head.session:03}.jsonl"
        self._fd = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        try:
            self._claim()
            whole = _whole_lines(self.path)
            os.ftruncate(self._fd, len(whole))  # a power cut may have left half of a line
            attempts: list[Attempt] = []
            if whole:
                before, attempts = _parsed(self.path, whole)
                if before.task != head.task:
                    self._other_task(before)
            else:
                self.write(head)
                self.sync()
                _sync_folder(home)
        except BaseException:
            self.close()
            raise
        self.whole = whole_blocks(attempts)
        self._attempts = [each.begin.block for each in attempts]

    def _claim(self) -> None:
        assert sys.platform != "win32"
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            unavailable(f"{self.path}: another `drumstick study run` writes it")

    def _other_task(self, before: Session) -> NoReturn:
        usage_error(
            f"{self.path}: session {before.session} of {before.player} was begun with another task,"
            f" {before.task.name!r}: give that one, or another --session"
        )

    def next_attempt(self, block: int) -> int:
        """Number, from 1, of the next attempt at this block."""
        self._attempts.append(block)
        return self._attempts.count(block)

    def write(self, record: Record) -> None:
        """Append a record; the system has it when this returns."""
        line = msgspec.json.encode(record) + b"\n"
        if os.write(self._fd, line) != len(line):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.path))

    def sync(self) -> None:
        """Return when the disk has all of it."""
        os.fsync(self._fd)

    def close(self) -> None:
        """Close it, and let others write it."""
        os.close(self._fd)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)  # the name too must outlive a power cut
    finally:
        os.close(descriptor)


def forget(folder: Path, player: str) -> int:
    """Delete a player's folder with all sessions; how many there were. Raises CommandError."""
    home = folder / checked_player(player)
    if home.is_symlink() or not home.is_dir():
        usage_error(f"{home}: there is no folder of this player")
    count = len(sessions(folder, player))
    shutil.rmtree(home)
    return count
