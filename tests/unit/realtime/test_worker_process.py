"""Worker process, where it ends on its own, and what it is to the machine."""

import os
import sys
from pathlib import Path

import pytest

from realtime.worker_process import NoAnswer, WorkerProcess

_ONE_ANSWER = "import sys; sys.stdin.readline(); print('[20.0, 0.5]', flush=True)"
_SERVES = """
import os, pathlib
from realtime.worker_process import serve
serve(str, lambda path: [os.getpriority(os.PRIO_PROCESS, 0), int(pathlib.Path(path).read_text())])
"""


def _worker(script: str, rest_s: float = 0.0, now: list[float] | None = None) -> WorkerProcess[list[float]]:
    times_s = now or [0.0]
    return WorkerProcess([sys.executable, "-c", script], list[float], rest_s, lambda: times_s[0])


def test_one_that_ended_between_two_questions_is_started_again() -> None:
    worker = _worker(_ONE_ANSWER)
    for _ in range(2):
        assert worker.ask("where?") == [20.0, 0.5]
        assert worker._process is not None  # pyright: ignore[reportPrivateUsage]
        worker._process.wait()  # pyright: ignore[reportPrivateUsage]
    worker.close()
    with pytest.raises(NoAnswer, match="closed"):
        worker.ask("where?")


def test_one_that_ends_in_place_of_an_answer_is_not_started_with_every_question(tmp_path: Path) -> None:
    starts, now = tmp_path / "starts", [0.0]
    worker = _worker(f"open({str(starts)!r}, 'a').write('x')", 10.0, now)
    for now[0] in (0.0, 1.0, 2.0, 3.0, 20.0):
        with pytest.raises(NoAnswer, match="ask again in 10 s"):
            worker.ask("where?")
    assert starts.read_text() == "xx"
    worker.close()


def test_an_answer_that_is_cut_off_is_none() -> None:
    worker = _worker("print('[20.0, 0', end='', flush=True)")
    with pytest.raises(NoAnswer, match="ended"):
        worker.ask("where?")
    worker.close()


def test_it_stays_behind_and_goes_first_where_memory_ends() -> None:
    worker = _worker(_SERVES)
    niceness, expendable = worker.ask("/proc/self/oom_score_adj")
    assert niceness == max(5, os.getpriority(os.PRIO_PROCESS, 0))
    assert expendable == 1000
    worker.close()
