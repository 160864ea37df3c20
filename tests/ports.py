"""Free ports for tests, such that no other test and no program of this machine is given them meanwhile."""

import errno
import random
import socket
from collections.abc import Iterator

# Below those that the kernel gives to whoever asks for any (32768 and above on Linux): between the look and its use, a
# port from there may become the source port of anybody's connection.
_BLOCKS = range(12_000, 32_000, 100)
_held: list[socket.socket] = []


def _is_free(port: int, *held: socket.socket) -> bool:
    try:
        for each in held:
            each.bind(("127.0.0.1", port))
    except OSError as refused:
        if refused.errno != errno.EADDRINUSE:
            raise
        return False
    return True


def _own_ports() -> Iterator[int]:
    # Whoever has the first port of a block has the block, until its process ends: so no other one draws from it in the
    # seconds between a look here and the start of the program that gets the port.
    for first in random.SystemRandom().sample(_BLOCKS, len(_BLOCKS)):
        block = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if _is_free(first, block):
            _held.append(block)
            yield from range(first + 1, first + _BLOCKS.step)
        else:
            block.close()


_own = _own_ports()


def free_port() -> int:
    """A port of 127.0.0.1 that is free for TCP and UDP; none twice."""
    for port in _own:
        with (
            socket.socket(socket.AF_INET, socket.SOCK_STREAM) as tcp,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
        ):
            if _is_free(port, tcp, udp):
                return port
    raise RuntimeError(f"no port of {_BLOCKS.start} to {_BLOCKS.stop} is free: other programs have them all")
