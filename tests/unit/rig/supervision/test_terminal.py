"""The supervisor's terminal: a status line below the log, and a terminal that stands still or is gone."""

import os

import pytest

from rig.supervision.terminal import Terminal
from unread import drained, full_pipe


def test_log_lines_stand_above_the_status_line() -> None:
    master, fd = os.openpty()
    terminal = Terminal(fd)
    terminal.status("playing")
    terminal.say("[servo] here")
    terminal.end_status()
    assert drained(master) == b"\r\x1b[2Kplaying\r\x1b[2K[servo] here\r\nplaying\r\x1b[2K"
    terminal.end_status()
    assert drained(master) == b""
    os.close(fd)
    os.close(master)


def test_a_file_or_pipe_has_no_status_line() -> None:
    reading, writing = os.pipe()
    terminal = Terminal(writing)
    terminal.status("playing")
    terminal.say("[servo] here")
    terminal.end_status()
    assert drained(reading) == b"[servo] here\n"
    os.close(reading)
    os.close(writing)


def test_a_reader_that_stands_still_holds_up_nobody() -> None:
    with full_pipe() as (reading, writing):
        terminal = Terminal(writing)
        for number in range(5000):
            terminal.say(f"[gateway] {number}")
        os.close(reading)
        terminal.end_status()  # nothing waits any more for a number that is soon another file's


def test_status_lines_do_not_pile_up_before_a_terminal_that_stands_still() -> None:
    master, fd = os.openpty()
    terminal = Terminal(fd)
    terminal.say("x" * 100_000)  # more than a terminal takes before somebody looks
    for number in range(5000):
        terminal.status(f"late {number}")
    shown = b""
    while not shown.endswith(b"\n"):
        shown += os.read(master, 65536)
    assert b"late" not in shown
    terminal.end_status()
    os.close(fd)
    os.close(master)


def test_a_terminal_that_is_gone_ends_what_is_shown_and_nothing_else() -> None:
    master, fd = os.openpty()
    terminal = Terminal(fd)
    os.close(master)
    terminal.status("playing")
    terminal.say("[servo] here")
    terminal.end_status()
    os.close(fd)
    terminal.say("[servo] here")
    terminal.end_status()


@pytest.mark.parametrize("reader_dies", [True, False])
def test_a_pipe_without_reader_and_a_full_disk(reader_dies: bool) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    fd = writing if reader_dies else os.open("/dev/full", os.O_WRONLY)
    terminal = Terminal(fd)
    terminal.say("[servo] here")
    terminal.end_status()
    os.close(fd)
    if not reader_dies:
        os.close(writing)
