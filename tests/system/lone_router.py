"""A Zenoh router in a process of its own, as a venue may have one: it can be killed and started again."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rig_process import free_port

_SCRIPT = """
import sys
from protocol.session import open_router
session = open_router(sys.argv[1], sys.argv[2:])
print("open", flush=True)
sys.stdin.read()
session.close()
"""


class LoneRouter:
    """At one endpoint, again and again; joined to the routers at `upstream`."""

    def __init__(self, *upstream: str) -> None:
        self._upstream = upstream
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.start()

    def start(self) -> None:
        """Returns when it listens."""
        self._process = subprocess.Popen(
            [sys.executable, "-c", _SCRIPT, self.endpoint, *self._upstream],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "open\n"

    @property
    def pid(self) -> int:
        """Number of the process that it is now."""
        return self._process.pid

    def kill(self) -> None:
        """At once, as a power cut does."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()


@contextmanager
def lone_router(*upstream: str) -> Iterator[LoneRouter]:
    router = LoneRouter(*upstream)
    try:
        yield router
    finally:
        router.kill()
