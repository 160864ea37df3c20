"""A stop request survives signals that arrive inside the handler of another."""

import os
import signal
import subprocess
import sys

import pytest

from realtime.stop import StopRequest

# With threading.Event in place of StopRequest this never ends: found when a parent's death sent several SIGTERMs.
PROGRAM = """
import os, signal, sys
from realtime.stop import StopRequest
stop = StopRequest()
signal.signal(signal.SIGTERM, stop.ask)
print("up", flush=True)
while not stop.wait(10.0):
    pass
"""


def test_many_signals_at_once_stop_it() -> None:
    with subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "up\n"
        try:
            for _ in range(50):  # a flood without end would nest handlers up to the recursion limit
                if program.poll() is not None:
                    break
                os.kill(program.pid, signal.SIGTERM)
            # A signal that meets the interpreter on its way out ends it too.
            assert program.wait(30.0) in (0, -signal.SIGTERM)
        finally:
            program.kill()


ENDED_BY_HANGUP = """
import signal, sys
from realtime.stop import StopRequest, on_stop_signals
if sys.argv[1] == "nohup":
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
stop = StopRequest()
on_stop_signals(stop.ask)
signal.raise_signal(signal.SIGHUP)
print("stopped" if stop.is_set() else "goes on")
signal.raise_signal(signal.SIGTERM)
print("stopped" if stop.is_set() else "goes on")
"""


@pytest.mark.parametrize(("started", "at_hangup"), [("plainly", "stopped"), ("nohup", "goes on")])
def test_a_hangup_stops_what_was_not_started_with_nohup(started: str, at_hangup: str) -> None:
    ended = subprocess.run([sys.executable, "-c", ENDED_BY_HANGUP, started], capture_output=True, text=True)
    assert ended.stdout.split("\n")[:2] == [at_hangup, "stopped"], ended.stderr


def test_it_waits_until_asked_or_until_the_time_is_over() -> None:
    stop = StopRequest()
    assert not stop.wait(0.0)
    assert not stop.wait(0.01)
    assert not stop.is_set()
    stop.ask()
    assert stop.wait(1000.0)
    assert stop.is_set()
