"""Lines to streams that stand still, are full or are gone: nobody waits, and what is lost is counted."""

import os
import threading
from collections.abc import Callable

import pytest

from realtime.line_writer import MAX_WAITING, LineWriter
from unread import drained, full_pipe

PATIENCE_S = 30.0


def taken(fd: int, is_whole: Callable[[str], bool]) -> str:
    """Text that comes out of the pipe, until it is whole; the dots that filled it left out."""
    found = b""
    while not is_whole(found.decode()):
        chunk = os.read(fd, 65536)
        assert chunk
        found += chunk
    return found.decode().lstrip(".")


@pytest.mark.parametrize("is_blocking", [True, False])
def test_an_unread_pipe_holds_up_nobody_and_the_loss_is_told_when_it_flows_again(is_blocking: bool) -> None:
    with full_pipe() as (reading, writing):
        os.set_blocking(writing, is_blocking)
        lines = LineWriter(writing)
        for number in range(MAX_WAITING + 500):
            lines.put(f"{number}\n")
        assert not lines.flush(0.0)
        assert not lines.is_idle
        assert 499 <= lines.lost <= 500  # the writing thread may hold one that is not in the queue
        lost = lines.lost
        told = f"{lost} lines are missing here: they could not be written\n"
        found = taken(reading, lambda text: text.endswith(told))
        kept = MAX_WAITING + 500 - lost
        # Which ones of the first are kept depends on when the thread took its first; none comes twice or out of order.
        numbers = [int(line) for line in found.removesuffix(told).split()]
        assert len(numbers) == kept
        assert numbers == sorted(set(numbers))
        assert lines.flush(PATIENCE_S)
        lines.put("on\n")
        assert taken(reading, lambda text: text.endswith("\n")) == "on\n"  # and the loss is told once
        assert lines.flush(PATIENCE_S)
        os.close(writing)


def test_a_line_longer_than_the_pipe_comes_whole() -> None:
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    lines = LineWriter(writing)
    lines.put("x" * 1_000_000 + "\n")
    assert taken(reading, lambda text: text.endswith("\n")) == "x" * 1_000_000 + "\n"
    assert lines.flush(PATIENCE_S)
    assert lines.lost == 0
    os.close(reading)
    os.close(writing)


def full_disk() -> int:
    return os.open("/dev/full", os.O_WRONLY)


def no_reader() -> int:
    reading, writing = os.pipe()
    os.close(reading)
    return writing


def gone_terminal() -> int:
    master, terminal = os.openpty()
    os.close(master)
    return terminal


@pytest.mark.parametrize("opened", [full_disk, no_reader, gone_terminal])
def test_output_that_fails_ends_output_and_nothing_else(opened: Callable[[], int]) -> None:
    fd = opened()
    lines = LineWriter(fd)
    for _ in range(100):
        lines.put("lost\n")
    assert lines.flush(PATIENCE_S)
    assert lines.lost == 100
    # As when a disk has room again: the same number, but something that takes lines.
    reading, writing = os.pipe()
    os.dup2(writing, fd)
    lines.put("here\n")
    assert lines.flush(PATIENCE_S)
    assert drained(reading).decode() == "here\n100 lines are missing here: they could not be written\n"
    for each in (fd, reading, writing):
        os.close(each)


@pytest.mark.parametrize("fd", [None, 987_654])
def test_a_closed_stream_is_written_for_nobody(fd: int | None) -> None:
    lines = LineWriter(fd)
    lines.put("lost\n")
    assert lines.flush(PATIENCE_S)
    assert lines.lost == 1


def test_lines_of_many_threads_come_whole_each_once() -> None:
    reading, writing = os.pipe()
    lines = LineWriter(writing)

    def put(who: int) -> None:
        for number in range(100):
            lines.put(f"{who} {number}\n")

    threads = [threading.Thread(target=put, args=(who,)) for who in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert lines.flush(PATIENCE_S)
    found = drained(reading).decode().splitlines()
    assert sorted(found) == sorted(f"{who} {number}" for who in range(8) for number in range(100))
    for who in range(8):
        assert [line for line in found if line.startswith(f"{who} ")] == [f"{who} {n}" for n in range(100)]
    os.close(reading)
    os.close(writing)


def test_what_no_encoding_has_is_written_all_the_same() -> None:
    reading, writing = os.pipe()
    lines = LineWriter(writing)
    lines.put("a\udcff\n")
    assert lines.flush(PATIENCE_S)
    assert drained(reading) == b"a\\udcff\n"
    os.close(reading)
    os.close(writing)
