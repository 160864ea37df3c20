"""So many connections from one address and in all; counted before any handshake."""

import socket
from collections.abc import Callable, Iterator

import pytest

from rig.machine.machine_needs import FILES
from web_panel.access.lan_listener import IN_ALL, KNOWN, OF_ONE, STRANGERS, LimitedListener

_OWN_FILES = 64  # of the page: 26 while one browser of this machine looks, by `drumstick lab panel-attack`


@pytest.fixture
def listener(free_port: Callable[[], int]) -> Iterator[LimitedListener]:
    with LimitedListener("127.0.0.1", free_port()) as made:
        made.setblocking(False)
        yield made


def dialled(listener: LimitedListener, source: str) -> socket.socket:
    return socket.create_connection(listener.getsockname(), timeout=10, source_address=(source, 0))


def taken(listener: LimitedListener) -> list[socket.socket]:
    """All that it accepts now."""
    found: list[socket.socket] = []
    try:
        while True:
            found.append(listener.accept()[0])
    except BlockingIOError:
        return found


def test_one_address_gets_so_many_and_another_one_still_comes_in(listener: LimitedListener) -> None:
    many = [dialled(listener, "127.0.0.2") for _ in range(OF_ONE + 3)]
    served = taken(listener)
    assert len(served) == OF_ONE
    assert many[-1].recv(1) == b""  # closed at once, not left waiting
    other = dialled(listener, "127.0.0.3")
    served += taken(listener)
    assert len(served) == OF_ONE + 1
    for each in (*many, *served, other):
        each.close()


def test_a_flood_leaves_the_loop_its_other_work(listener: LimitedListener) -> None:
    many = [dialled(listener, "127.0.0.2") for _ in range(2 * OF_ONE)]
    served = [listener.accept()[0] for _ in range(OF_ONE)]
    many += [dialled(listener, "127.0.0.2") for _ in range(4)]  # beyond the 16 that one call closes
    served += taken(listener)
    many[-1].setblocking(False)
    with pytest.raises(BlockingIOError):
        many[-1].recv(1)  # waits still
    taken(listener)
    many[-1].settimeout(10.0)
    assert many[-1].recv(1) == b""
    for each in (*many, *served):
        each.close()


def test_whoever_left_makes_room(listener: LimitedListener) -> None:
    many = [dialled(listener, "127.0.0.2") for _ in range(OF_ONE)]
    served = taken(listener)
    served.pop().close()
    late = dialled(listener, "127.0.0.2")
    served += taken(listener)
    assert len(served) == OF_ONE
    for each in (*many, *served, late):
        each.close()


def test_all_together_leave_the_page_its_files(listener: LimitedListener) -> None:
    clients, served = list[socket.socket](), list[socket.socket]()
    for i in range(5):
        clients += [dialled(listener, f"127.0.0.{i + 2}") for _ in range(OF_ONE)]
        served += taken(listener)
    assert len(served) == STRANGERS
    for each in (*clients, *served):
        each.close()


def test_who_came_in_before_has_places_that_strangers_cannot_take(listener: LimitedListener) -> None:
    for i in range(KNOWN + 4):
        listener.keep_places_for(f"127.0.1.{i}")
    listener.keep_places_for("127.0.1.4")
    clients, served = list[socket.socket](), list[socket.socket]()
    for i in range(5):
        clients += [dialled(listener, f"127.0.0.{i + 2}") for _ in range(OF_ONE)]
        served += taken(listener)
    assert len(served) == STRANGERS
    for source, places in ((f"127.0.1.{KNOWN + 3}", OF_ONE), ("127.0.1.4", OF_ONE), ("127.0.1.3", 0)):
        clients += [dialled(listener, source) for _ in range(OF_ONE + 1)]
        found = taken(listener)
        assert len(found) == places
        served += found
    for each in (*clients, *served):
        each.close()


def test_the_page_keeps_files_whoever_is_known(listener: LimitedListener) -> None:
    """Also when those who are known make room for others and keep their connections."""
    assert IN_ALL <= FILES - _OWN_FILES
    served = list[socket.socket]()
    for i in range(2 * KNOWN):
        listener.keep_places_for(f"127.0.1.{i}")
        clients = [dialled(listener, f"127.0.1.{i}") for _ in range(OF_ONE)]
        served += taken(listener)
        for each in clients:
            each.close()
    assert len(served) == IN_ALL
    for each in served:
        each.close()


def test_a_taken_port_is_told(listener: LimitedListener) -> None:
    with pytest.raises(OSError, match="in use"):
        LimitedListener(*listener.getsockname())
