"""The pipe to the process that has the library: what goes down it, and processes that end, hang or wait."""

import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from haptic_server.gateway.midi import port_process as processes
from haptic_server.gateway.midi.options import MidiOptions
from haptic_server.gateway.midi.port_process import PortProcess
from osc_bench import BOUND_S, Time
from realtime.service_options import command

OPENED = "import sys, os, json; print(json.dumps({'open': True, 'words': 'strikes go to X'}), flush=True)\n"
KEEPS = OPENED + "open(sys.argv[1], 'ab').write(sys.stdin.buffer.read())\n"
NOTE = b"\x99\x26\x40"


@pytest.fixture
def made() -> Iterator[Callable[..., PortProcess]]:
    ports: list[PortProcess] = []

    def make(script: str, *words: str) -> PortProcess:
        ports.append(PortProcess([sys.executable, "-c", script, *words]))
        return ports[-1]

    yield make
    for port in ports:
        port.close()


def look_until(port: PortProcess, what: Callable[[], object], now: Callable[[], float]) -> list[str]:
    """Everything that `look` told on the way."""
    told: list[str] = []
    end = time.monotonic() + BOUND_S
    while not what():
        assert time.monotonic() < end, told
        news = port.poll(now())
        told += [news] if news else []
        time.sleep(0.002)
    return told


def test_messages_arrive_whole_and_in_order(
    made: Callable[..., PortProcess], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "_END_WITHIN_S", BOUND_S)
    port = made(KEEPS, str(tmp_path / "sent"))
    assert not port.is_open
    assert not port.send(NOTE)
    assert look_until(port, lambda: port.is_open, Time()) == ["strikes go to X"]
    for velocity in range(128):
        assert port.send(bytes((0x99, 38, velocity)))
    port.close()
    assert (tmp_path / "sent").read_bytes() == b"".join(bytes((0x99, 38, v)) for v in range(128))
    assert not port.is_open
    port.close()


def test_a_process_that_ends_is_told_once_and_started_again_in_a_while(
    made: Callable[..., PortProcess],
) -> None:
    now = Time()
    port = made("raise SystemExit(7)")
    told = look_until(port, lambda: port._process is None and port._start_at_s > now(), now)
    told += look_until(port, lambda: port._process is None and port._start_at_s > now(), now)
    assert told == ["the MIDI library ended with status 7; trying again"]
    for _ in range(3):
        now.s += processes.RETRY_S
        port.poll(now())
        assert port._process is not None
        assert look_until(port, lambda: port._process is None, now) == []


def test_a_process_that_aborts_after_it_was_open(made: Callable[..., PortProcess]) -> None:
    now = Time()
    port = made(OPENED + "sys.stdin.buffer.read(3); os.abort()")
    look_until(port, lambda: port.is_open, now)
    assert port.send(NOTE)
    told = look_until(port, lambda: not port.is_open, now)
    assert told == ["the MIDI library ended with status -6; trying again"]
    now.s += processes.RETRY_S
    assert look_until(port, lambda: port.is_open, now) == ["strikes go to X"]


def test_a_process_that_hangs_is_ended(made: Callable[..., PortProcess]) -> None:
    now = Time()
    port = made(OPENED + "import time; time.sleep(1000)")
    look_until(port, lambda: port.is_open, now)
    sent = 0
    while port.send(NOTE * 100):
        sent += 1
        assert sent < 100_000
    assert not port.is_open
    assert look_until(port, lambda: port._process is None, now) == [
        "the MIDI library ended with status -9; trying again"
    ]


# Says "a"; then "b" and "c" in one go; then "d"; then "e" and "f": each when the file of its number is there.
STEPS = """
import json, pathlib, sys, time
for step, said in enumerate(([(0, "a")], [(0, "b"), (1, "c")], [(0, "d")], [(0, "e"), (1, "f")])):
    while not (pathlib.Path(sys.argv[1]) / str(step)).exists():
        time.sleep(0.001)
    print("\\n".join(json.dumps({"open": bool(open), "words": words}) for open, words in said), flush=True)
sys.stdin.buffer.read()
"""


def test_a_port_that_waits_is_told_once_until_it_was_open(
    made: Callable[..., PortProcess], tmp_path: Path
) -> None:
    port = made(STEPS, str(tmp_path))
    told: list[str] = []
    for step in range(4):
        (tmp_path / str(step)).touch()
        end = time.monotonic() + BOUND_S
        while len(told) == step:
            assert time.monotonic() < end, told
            told += [news] if (news := port.poll(Time()())) else []
            port.wait(0.01)
        assert port.is_open == bool(step % 2)
    assert told == ["a", "c", "d", "f"]


def test_close_does_not_wait_for_ever(
    made: Callable[..., PortProcess], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "_END_WITHIN_S", 0.05)
    port = made(OPENED + "import time; time.sleep(1000)")
    look_until(port, lambda: port.is_open, Time())
    child = port._process
    assert child is not None
    port.close()
    assert child.returncode == -9


def test_the_real_process_waits_for_what_is_not_there(
    made: Callable[..., PortProcess], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("JACK_DEFAULT_SERVER", "no-such-server")
    monkeypatch.setenv("JACK_NO_START_SERVER", "1")
    monkeypatch.setattr(processes, "_END_WITHIN_S", BOUND_S)
    port = PortProcess(
        command("haptic_server.gateway.midi", MidiOptions(client="drumstick test", port="no such port"))
    )
    try:
        told: list[str] = []
        told += look_until(port, lambda: told or port._told_away, Time())
        # Which of the two depends on whether this machine has ALSA's sequencer.
        assert told[0].startswith(("no MIDI system runs here", "no port has 'no such port' in its name"))
        assert len(told) == 1
        assert port._process is not None
        child = port._process
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # as a whole group gets them
            child.send_signal(number)
    finally:
        port.close()
    assert child.returncode == 0  # ended by the end of its input, and by no signal
