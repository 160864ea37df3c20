"""A session as it is played, beside a rig of paper: what is logged, and what ends it."""

import queue
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import pytest

from protocol.clock import HapticClock
from protocol.messages import Strike, encode
from realtime.stop import StopRequest
from rig.exit_status import CommandError
from rig.study import session, session_log
from rig.study.rig_link import METRONOME
from rig.study.session import StudySession
from rig.study.session_log import Session, SessionLog
from rig.study.task import Block, Task

OFFSET_NS = 7 * 10**12  # the haptic machine's clock less ours
LED = Block(name="led", condition="pad", rate_Hz=20.0, strikes=3, metronome="throughout", count_in=1)
FREE = Block(name="free", condition="stick", duration_s=0.1, rest_s=0.1)


@pytest.fixture(autouse=True)
def no_time_to_get_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody has to be ready for the first click of a paper rig, a second after it was announced."""
    monkeypatch.setattr(session, "_LEAD_S", 0.1)


class PaperLink:
    """Strikes at once, and again with each click; `boots` are answered in turn, the last one for ever."""

    def __init__(self, boots: list[int], on_click: Callable[[], None] = lambda: None) -> None:
        self.heard: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._boots, self._on_click, self._seq = boots, on_click, 0
        self.clicks_ns: list[int] = []

    def put(self, source: str) -> int:
        t_ns = time.monotonic_ns() + OFFSET_NS
        self._seq += 1
        strike = Strike(boot=1, seq=self._seq, t_ns=t_ns, x=0.0, y=0.0, z_speed_m_per_s=1.0, level=0.5,
                        peak_estimate_N=1.0, contact_estimate_s=0.001, source=source)  # fmt: skip
        self.heard.put(encode(strike))
        return t_ns

    def click(self, _task: Task) -> int:
        self.clicks_ns.append(self.put(METRONOME))
        self.put("stick")
        self._on_click()
        return self.clicks_ns[-1]

    def clock(self) -> HapticClock:
        boot = self._boots.pop(0) if len(self._boots) > 1 else self._boots[0]
        return HapticClock(boot, OFFSET_NS, 0)

    def scene(self) -> str:
        self.put("stick")  # in the rest before a block
        return "roll"

    def meter(self) -> None:
        return None


def played(
    folder: Path, link: PaperLink, stop: StopRequest, said: list[str], blocks: list[Block]
) -> tuple[bool, Path]:
    task = Task(name="t", block=blocks)
    log = SessionLog(folder, Session("p01", 1, "", "main", "0", task))
    try:
        return StudySession(cast(Any, link), log, task, stop, said.append).run(), log.path
    finally:
        log.close()


def test_each_block_has_its_own_strikes_and_no_rest_has_any(tmp_path: Path) -> None:
    link, said = PaperLink([1]), list[str]()
    whole, path = played(tmp_path, link, StopRequest(), said, [LED, FREE])
    assert whole
    led, free = session_log.read(path)[1]
    assert [click.strike for click in led.clicks] == [-1, 0, 1, 2]
    assert [click.t_ns for click in led.clicks] == link.clicks_ns
    assert [click.due_ns - led.begin.first_ns for click in led.clicks] == [
        -50_000_000,
        0,
        50_000_000,
        100_000_000,
    ]
    assert all(click.t_ns >= click.due_ns for click in led.clicks)
    assert (len(led.strikes), len(free.strikes)) == (4, 0)
    assert led.end is not None
    assert (led.end.lost, led.end.output_latency_ms) == (0, None)
    assert said[0].startswith(
        "Block 1 of 2, led: pad. 1200 strikes a minute, 3 strikes, 0.15 s, with the metronome"
    )
    assert said[1:] == ["Block 2 of 2, free: stick. At your own rate, 0.1 s.", "Play."]


def test_a_rig_that_begins_anew_ends_the_block(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="began anew in block 1, which is left off"):
        played(tmp_path, PaperLink([1, 2]), StopRequest(), [], [LED])
    (attempt,) = session_log.read(tmp_path / "p01" / "session-001.jsonl")[1]
    assert attempt.end is None
    assert len(attempt.strikes) == 4
    assert played(tmp_path, PaperLink([2]), StopRequest(), [], [LED])[0]


def test_a_stop_keeps_what_was_played(tmp_path: Path) -> None:
    stop = StopRequest()
    whole, path = played(tmp_path, PaperLink([1], stop.ask), stop, [], [LED, FREE])
    assert not whole
    (attempt,) = session_log.read(path)[1]
    assert (attempt.end, len(attempt.clicks), len(attempt.strikes)) == (None, 1, 1)


def test_a_rig_that_goes_away_takes_no_strike_with_it(tmp_path: Path) -> None:
    def gone() -> None:
        raise CommandError(3, "nobody answers")

    with pytest.raises(CommandError, match="nobody answers"):
        played(tmp_path, PaperLink([1], gone), StopRequest(), [], [LED])
    (attempt,) = session_log.read(tmp_path / "p01" / "session-001.jsonl")[1]
    assert (attempt.end, len(attempt.clicks), len(attempt.strikes)) == (None, 0, 1)
