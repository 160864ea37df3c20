"""The websockets of the stage pages: they only listen. viser's thread, but for `show` and `watched`.

Whoever gets here has passed web_panel.access.admission. Each page has a task of its own and is sent the newest frame
only: what a slow one has not taken when the next is there is dropped, and it holds up nobody.
"""

import asyncio

import websockets.asyncio.server as websocket_server
from websockets.exceptions import ConnectionClosed

PATH = "/stage/state"
MOST_PAGES = 8
_TAKES_S = 5.0  # a page that takes nothing for so long is closed


class _Viewer:
    """The newest frame for one page, until it is sent."""

    def __init__(self) -> None:
        self._frame = b""
        self._is_new = asyncio.Event()

    def put(self, frame: bytes) -> None:
        self._frame = frame
        self._is_new.set()

    async def get(self) -> bytes:
        await self._is_new.wait()
        self._is_new.clear()
        return self._frame


class StageSocket:
    """Serves the stage pages, eight at most."""

    def __init__(self) -> None:
        self._viewers: set[_Viewer] = set()
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def watched(self) -> bool:
        """True while a page is open. Any thread."""
        return bool(self._viewers)

    def show(self, frame: bytes) -> None:
        """Send this to every page, instead of what it has not taken yet; never blocks. Main thread."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._put, frame)

    def _put(self, frame: bytes) -> None:
        for viewer in self._viewers:
            viewer.put(frame)

    async def serve(self, connection: websocket_server.ServerConnection) -> None:
        """One page, to its end; one that sends anything is closed."""
        if len(self._viewers) >= MOST_PAGES:
            await connection.close(1013, "too many stage pages are open")
            return
        self._loop = asyncio.get_running_loop()
        viewer = _Viewer()
        self._viewers.add(viewer)
        sending = asyncio.create_task(_send(connection, viewer))
        try:
            await connection.recv()
            await connection.close(1008, "a stage page only listens")
        except ConnectionClosed:
            pass
        finally:
            self._viewers.discard(viewer)
            sending.cancel()


async def _send(connection: websocket_server.ServerConnection, viewer: _Viewer) -> None:
    try:
        while True:
            frame = await viewer.get()
            async with asyncio.timeout(_TAKES_S):
                await connection.send(frame, text=True)
    except TimeoutError:
        connection.transport.abort()
    except ConnectionClosed:
        return
