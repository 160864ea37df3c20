"""`drumstick study`: run a session, export all of them, forget a player."""

import sys
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import drumstick
from realtime.stop import StopRequest, on_stop_signals
from rig.exit_status import unavailable, usage_error
from rig.network.remote import opened
from rig.network.remote_rig import RemoteRig
from rig.study import session_log, table, task
from rig.study.session_log import Session, SessionLog

ON_WINDOWS = "drumstick study runs on Linux and macOS only"
_say = partial(print, flush=True)


def run(end: RemoteRig, player: str, number: int | None, task_file: Path, folder: Path) -> None:
    """Play a session, or what is left of it, until its end or a signal. Raises CommandError. The main thread."""
    from rig.study.rig_link import RigLink
    from rig.study.session import StudySession

    if sys.platform == "win32":
        unavailable(ON_WINDOWS)
    session_log.checked_player(player)
    wanted = task.read(task_file)
    chosen = session_log.next_session(folder, player) if number is None else number
    if not 1 <= chosen <= session_log.MAX_SESSION:
        usage_error(f"--session {chosen}: must be 1 .. {session_log.MAX_SESSION}")
    stop = StopRequest()
    on_stop_signals(stop.ask)
    with opened(end, lambda: not stop.is_set()) as session:
        link = RigLink(session, end.keys)
        link.clock()  # no file for a rig that is not there
        now = datetime.now(UTC).astimezone().isoformat(timespec="seconds")
        head = Session(player, chosen, now, end.keys.rig, drumstick.__version__, wanted)
        log = SessionLog(folder, head)
        try:
            _say(f"{player}, session {chosen}: {log.path}")
            if len(log.whole) == len(wanted.block):
                usage_error(
                    f"{log.path}: session {chosen} is whole; give another --session, or none for the next"
                )
            whole = StudySession(link, log, wanted, stop, _say).run()
        finally:
            log.close()
    _say(
        "The session is whole."
        if whole
        else "Stopped; the same command goes on with the block that was left off."
    )


def export(folder: Path, out: Path) -> None:
    """Write `out`, a row a strike, and beside it a file with a row for each block. Raises CommandError."""
    if out.suffix != ".csv":
        usage_error(f"--out {out}: a table's name ends in .csv")
    if not out.parent.is_dir():
        usage_error(f"--out {out}: there is no folder {out.parent}")
    strikes: list[table.Row] = []
    blocks: list[table.Row] = []
    logs = [
        path
        for player in session_log.players(folder)
        for path in session_log.sessions(folder, player).values()
        if not session_log.is_empty(path)
    ]
    if not logs:
        usage_error(f"{folder}: no player's folder with a session in it, such as p01/session-001.jsonl")
    for path in logs:
        head, attempts = session_log.read(path)
        strikes += table.strike_rows(head, attempts)
        blocks += table.block_rows(head, attempts)
    beside = out.with_name(f"{out.stem}-blocks.csv")
    table.write(out, table.STRIKE_COLUMNS, strikes)
    table.write(beside, table.BLOCK_COLUMNS, blocks)
    _say(f"{out}: {len(strikes)} strikes; {beside}: {len(blocks)} blocks and phases; {len(logs)} sessions")


def forget(folder: Path, player: str) -> None:
    """Delete everything that the folder has of a player. Raises CommandError."""
    count = session_log.forget(folder, player)
    _say(f"{folder / player}: deleted, {count} sessions. Tables that were exported before still have them.")
