"""A service as a child: what ends the whole rig, and what is only started again."""

import errno
import gc
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rig.supervision.process import Service


def service(code: str, said: list[str]) -> Service:
    return Service("part", [sys.executable, "-c", code], said.append)


def look_until(part: Service, good: Callable[[], bool]) -> None:
    end = time.monotonic() + 30.0
    while not good():
        assert time.monotonic() < end
        part.poll(time.monotonic())
        time.sleep(0.01)


def test_what_the_machine_lacks_at_the_first_start_is_final() -> None:
    part = service("print('port taken'); raise SystemExit(3)", [])
    part.start()
    look_until(part, lambda: part.fault_status is not None)
    assert part.fault_status == 3
    assert part.last_line == "port taken"
    assert part.pid is None


def test_a_port_that_is_taken_during_a_restart_ends_nothing(tmp_path: Path) -> None:
    # Dies by a signal, then finds its port taken once, then runs.
    code = f"""
import os, pathlib, signal, time
starts = pathlib.Path({str(tmp_path / "starts")!r})
count = len(starts.read_text()) if starts.exists() else 0
starts.write_text("x" * (count + 1))
if count == 0:
    os.kill(os.getpid(), signal.SIGKILL)
if count == 1:
    raise SystemExit(3)
print("playing", flush=True)
time.sleep(60)
"""
    said: list[str] = []
    part = service(code, said)
    part.start()
    try:
        look_until(part, lambda: part.last_line == "playing")
        assert part.fault_status is None
        assert part.restarts == 2
        assert "[part] ended with status 3; restarting" in said
    finally:
        part.ask_to_stop()
        assert part.wait_stopped(time.monotonic() + 20.0)


def test_what_is_not_essential_stays_away_when_it_cannot_run_and_that_is_said_once() -> None:
    said: list[str] = []
    for status in (0, 2, 3):
        part = Service("record", [sys.executable, "-c", f"raise SystemExit({status})"], said.append, False)
        part.start()
        line = f"[record] ended with status {status}; the rig plays on without it"
        look_until(part, lambda line=line: line in said)
        for seconds in range(60):
            part.poll(time.monotonic() + seconds)
        assert said.count(line) == 1
        assert (part.fault_status, part.restarts, part.pid) == (None, 0, None)
        assert part.wait_stopped(time.monotonic())


def test_what_is_not_essential_is_started_again_after_a_crash(tmp_path: Path) -> None:
    code = f"""
import os, pathlib, signal
mark = pathlib.Path({str(tmp_path / "mark")!r})
if not mark.exists():
    mark.touch()
    os.kill(os.getpid(), signal.SIGKILL)
raise SystemExit(3)
"""
    said: list[str] = []
    part = Service("record", [sys.executable, "-c", code], said.append, essential=False)
    part.start()
    look_until(part, lambda: any("status 3; the rig plays on" in line for line in said))
    assert "[record] was ended by SIGKILL; restarting" in said
    assert (part.restarts, part.fault_status) == (1, None)


def test_started_anew_it_may_find_that_it_cannot_run_now(tmp_path: Path) -> None:
    # Runs, is stopped, and at its next first start lacks something.
    marker = tmp_path / "started"
    code = f"""
import pathlib, time
marker = pathlib.Path({str(marker)!r})
if marker.exists():
    raise SystemExit(2)
marker.touch()
print("playing", flush=True)
time.sleep(60)
"""
    said: list[str] = []
    part = service(code, said)
    part.start()
    look_until(part, lambda: part.last_line == "playing")
    part.ask_to_stop()
    assert part.wait_stopped(time.monotonic() + 20.0)
    part.start_anew()
    look_until(part, lambda: part.fault_status is not None)
    assert (part.fault_status, part.restarts) == (2, 0)
    marker.unlink()
    part.start_anew()
    assert part.fault_status is None
    part.ask_to_stop()
    assert part.wait_stopped(time.monotonic() + 20.0)


@pytest.mark.parametrize("complain", [True, False])
def test_one_that_does_not_stop_is_killed(complain: bool) -> None:
    code = """
import signal, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
print("playing", flush=True)
while True:
    time.sleep(60)
"""
    said: list[str] = []
    part = service(code, said)
    part.start()
    look_until(part, lambda: part.last_line == "playing")
    part.ask_to_stop()
    assert not part.wait_stopped(time.monotonic(), complain=complain)
    assert (said[-1] == "[part] did not stop when asked; killed") == complain


def test_a_supervisor_that_stands_still_holds_up_nothing_that_the_child_prints(tmp_path: Path) -> None:
    # Natively, as a sound library does; nobody looks meanwhile.
    mark = tmp_path / "printed"
    code = f"""
import os, pathlib, time
lost = 0
for _ in range(100):
    for fd in (1, 2):
        try:
            os.write(fd, b"underrun" * 500 + b"\\n")
        except BlockingIOError:
            lost += 1
pathlib.Path({str(mark)!r}).write_text(str(lost))
time.sleep(60)
"""
    said: list[str] = []
    part = service(code, said)
    part.start()
    try:
        end = time.monotonic() + 30.0
        while not mark.exists():
            assert time.monotonic() < end
            time.sleep(0.01)
        part.poll(time.monotonic())
        assert f"[part] {'underrun' * 500}" in said
    finally:
        part.ask_to_stop()
        assert part.wait_stopped(time.monotonic() + 20.0)


def test_a_machine_without_a_process_left_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork fails while a dead part is started again, twice; then it runs."""
    said: list[str] = []
    part = service("import time; print('playing', flush=True); time.sleep(60)", said)
    part.start()
    real, refused = subprocess.Popen, 0

    def fork(*given: Any, **options: Any) -> Any:
        nonlocal refused
        if refused < 2:
            refused += 1
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        return real(*given, **options)

    try:
        look_until(part, lambda: part.last_line == "playing")
        first = part.pid
        assert first is not None
        gc.collect()  # what earlier tests left has no part in it
        before = len(os.listdir("/proc/self/fd"))
        monkeypatch.setattr(subprocess, "Popen", fork)
        os.kill(first, signal.SIGKILL)
        look_until(part, lambda: part.pid not in (None, first))
        assert refused == 2
        assert sum("cannot be started: Resource temporarily unavailable" in line for line in said) == 2
        assert len(os.listdir("/proc/self/fd")) <= before
    finally:
        part.ask_to_stop()
        assert part.wait_stopped(time.monotonic() + 20.0)
