"""A websocket over TLS, all of it in one thread, for tests that make plain calls."""

import asyncio
import threading
from collections.abc import Coroutine
from typing import Any, TypeVar

from websockets.asyncio.client import connect
from websockets.http11 import Response

_T = TypeVar("_T")


class TlsWire:
    """Like a connection of `websockets.sync`. Its two threads, which read and write one TLS connection, were seen to
    lose an answer with Python 3.11: whoever dialled waited ten seconds for it. Raises what `websockets` raises.
    """

    def __init__(self, address: str, **how: Any) -> None:
        """`how`: what `websockets` takes for a client."""
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        try:
            # Whoever reads no more must still see the answer to his close.
            self._socket = self._done(self._dial(address, {"proxy": None, "max_queue": None, **how}))
        except BaseException:
            self._end()
            raise

    async def _dial(self, address: str, how: dict[str, Any]) -> Any:
        return await connect(address, **how)

    def _done(self, work: Coroutine[Any, Any, _T]) -> _T:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    @property
    def response(self) -> Response:
        """The answer by which it was opened."""
        return self._socket.response

    def recv(self, timeout: float | None = None) -> str | bytes:
        """The next message; TimeoutError after `timeout` s."""
        return self._done(asyncio.wait_for(self._socket.recv(), timeout))

    def send(self, message: str | bytes) -> None:
        self._done(self._socket.send(message))

    def close(self) -> None:
        try:
            self._done(self._socket.close())
        finally:
            self._end()

    def __enter__(self) -> "TlsWire":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
