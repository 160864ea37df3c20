"""Sockets of this process by their addresses: a peer's link is shut, a listener never sees who says nothing."""

import socket
from contextlib import ExitStack

from rig_process import free_port

from haptic_server.access.sockets import hold_silent, shut_down


def test_a_connection_is_shut_by_its_peers_address() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_server(("127.0.0.1", 0)) as other:
        far, kept = (
            socket.create_connection(server.getsockname()),
            socket.create_connection(other.getsockname()),
        )
        near, _ = server.accept()
        with far, kept, near:
            host, port = far.getsockname()
            assert shut_down(f"::ffff:{host}", port)
            far.settimeout(10.0)
            assert far.recv(1) == b""
            kept.sendall(b"still there")
            assert not shut_down("127.0.0.1", free_port())


def test_who_speaks_is_accepted_before_all_who_came_earlier_and_say_nothing() -> None:
    with ExitStack() as stack:
        server = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=128))
        port = server.getsockname()[1]
        assert hold_silent(port)
        silent = [stack.enter_context(socket.create_connection(("127.0.0.1", port))) for _ in range(50)]
        good = stack.enter_context(socket.create_connection(("127.0.0.1", port)))
        good.sendall(b"hello")
        server.settimeout(10.0)
        near, who = server.accept()
        with near:
            assert who == good.getsockname()
            assert near.recv(5) == b"hello"
        assert len({each.getsockname() for each in silent}) == 50
        assert not hold_silent(free_port())
