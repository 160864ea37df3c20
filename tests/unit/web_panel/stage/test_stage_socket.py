"""The stage pages' websocket: it sends the newest frame, takes nothing, and lets nobody wait for a slow page."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, cast

import pytest
from websockets.exceptions import ConnectionClosedError

from web_panel.stage import stage_socket
from web_panel.stage.stage_socket import MOST_PAGES, StageSocket


class Page:
    """A websocket; `sends` is what it sends at last, `takes` whether it reads."""

    def __init__(self, takes: bool = True) -> None:
        self.got: list[bytes] = []
        self.closed_by: tuple[int, str] | None = None
        self.aborted = False
        self.transport = self
        self._takes = asyncio.Event()
        self._spoken: asyncio.Queue[object] = asyncio.Queue()
        if takes:
            self._takes.set()

    def speak(self, frame: object) -> None:
        self._spoken.put_nowait(frame)

    def take_on(self) -> None:
        self._takes.set()

    async def recv(self) -> object:
        frame = await self._spoken.get()
        if isinstance(frame, Exception):
            raise frame
        return frame

    async def send(self, frame: bytes, text: bool) -> None:
        assert text
        await self._takes.wait()
        self.got.append(frame)

    async def close(self, code: int, reason: str) -> None:
        self.closed_by = code, reason

    def abort(self) -> None:
        self.aborted = True
        self.speak(ConnectionClosedError(None, None))


async def until(true: Callable[[], Any]) -> None:
    while not true():
        await asyncio.sleep(0)


def played(test: Callable[[StageSocket], Awaitable[None]]) -> None:
    asyncio.run(asyncio.wait_for(cast(Any, test)(StageSocket()), 30.0))


def opened(socket: StageSocket, page: Page) -> "asyncio.Task[None]":
    return asyncio.get_running_loop().create_task(socket.serve(cast(Any, page)))


def test_a_frame_reaches_every_page_until_it_ends() -> None:
    async def test(socket: StageSocket) -> None:
        socket.show(b"nobody looks")
        pages = [Page(), Page()]
        tasks = [opened(socket, page) for page in pages]
        await until(lambda: socket.watched)
        socket.show(b"1")
        await until(lambda: all(page.got == [b"1"] for page in pages))
        pages[0].speak(ConnectionClosedError(None, None))
        await tasks[0]
        assert socket.watched
        socket.show(b"2")
        await until(lambda: pages[1].got == [b"1", b"2"])
        pages[1].speak(ConnectionClosedError(None, None))
        await tasks[1]
        assert not socket.watched
        assert pages[0].got == [b"1"]

    played(test)


@pytest.mark.parametrize("spoken", ["", "[0, 0, 1]", b"\x00", "x" * 16_000])
def test_a_page_that_says_anything_is_closed(spoken: object) -> None:
    async def test(socket: StageSocket) -> None:
        page = Page()
        page.speak(spoken)
        await opened(socket, page)
        assert page.closed_by == (1008, "a stage page only listens")
        assert not socket.watched

    played(test)


def test_a_slow_page_gets_the_newest_only_and_holds_up_no_other() -> None:
    async def test(socket: StageSocket) -> None:
        slow, quick = Page(takes=False), Page()
        for page in (slow, quick):
            opened(socket, page)
        await until(lambda: socket.watched)
        for number in range(100):
            socket.show(b"%d" % number)
            await until(lambda n=number: quick.got[-1:] == [b"%d" % n])
        assert slow.got == []
        slow.take_on()
        await until(lambda: slow.got[-1:] == [b"99"])
        assert len(slow.got) <= 2

    played(test)


def test_a_page_that_takes_nothing_is_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage_socket, "_TAKES_S", 0.01)

    async def test(socket: StageSocket) -> None:
        dead = Page(takes=False)
        task = opened(socket, dead)
        await until(lambda: socket.watched)
        socket.show(b"1")
        await task
        assert dead.aborted
        assert not socket.watched

    played(test)


def test_so_many_pages_and_no_more() -> None:
    async def test(socket: StageSocket) -> None:
        pages = [Page() for _ in range(MOST_PAGES)]
        tasks = [opened(socket, page) for page in pages]
        await until(lambda: socket.watched)
        one_too_many = Page()
        await opened(socket, one_too_many)
        assert one_too_many.closed_by == (1013, "too many stage pages are open")
        pages[0].speak(ConnectionClosedError(None, None))
        await tasks[0]
        opened(socket, late := Page())
        await asyncio.sleep(0)
        socket.show(b"1")
        await until(lambda: late.got == [b"1"])

    played(test)
