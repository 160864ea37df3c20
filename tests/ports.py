"""Free ports for tests, such that no other test and no program of this machine is given them meanwhile."""

import errno
import random
import socket

# Below those that the kernel gives to whoever asks for any (32768 and above on Linux): between the look and its use, a
# port from there may become the source port of anybody's connection. Drawn anew in each process.
_FIRST, _LAST = 12_000, 32_000
_draw = random.SystemRandom()
_given: set[int] = set()  # one rig asks for five: none may get the same one twice


def free_port() -> int:
    """A port of 127.0.0.1 that is free for TCP and UDP."""
    while True:
        port = _draw.randint(_FIRST, _LAST)
        if port in _given:
            continue
        with (
            socket.socket(socket.AF_INET, socket.SOCK_STREAM) as tcp,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
        ):
            try:
                tcp.bind(("127.0.0.1", port))
                udp.bind(("127.0.0.1", port))
            except OSError as refused:
                if refused.errno != errno.EADDRINUSE:
                    raise
                continue
        _given.add(port)
        return port
