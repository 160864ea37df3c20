"""The stage pages of `drumstick lab panel-stage`: they settle by frames, and are cut off without a word."""

import threading
from collections.abc import Iterator

import pytest
from websockets.sync.server import ServerConnection, serve

from drumstick_lab.benchmarks.panel.panel_stage import DEAD, READING, StagePage


@pytest.fixture
def frames() -> Iterator[tuple[int, threading.Semaphore]]:
    """Port of a server that sends a frame for each release of the semaphore."""
    allowed = threading.Semaphore(0)

    def send(connection: ServerConnection) -> None:
        while allowed.acquire(timeout=10.0):
            connection.send("frame")

    with serve(send, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.socket.getsockname()[1], allowed
        allowed.release(100)
        server.shutdown()
        thread.join()


def test_a_page_has_settled_once_it_was_sent_so_many_frames(
    frames: tuple[int, threading.Semaphore],
) -> None:
    port, allowed = frames
    page = StagePage(port, "a=b", READING, to_settle=3)
    allowed.release(2)
    assert not page._settled.is_set()
    allowed.release(1)
    page.settle()
    assert page.frames == 3
    page.close()


def test_a_page_that_is_cut_off_has_no_thread_left_that_pings(
    frames: tuple[int, threading.Semaphore],
) -> None:
    page = StagePage(frames[0], "a=b", DEAD)
    assert page._socket.ping_interval is None
    page.close()
