"""The TCP port of the page. viser silently takes the next one when its port is taken, so it is tried before."""

import socket


def free_port(wanted: int) -> int:
    """`wanted`, or for 0 any free port of 127.0.0.1; OSError or OverflowError when it cannot be had. Any thread."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", wanted))
        return int(probe.getsockname()[1])
