"""A slider between the browser that moves it and the main thread that moves it too."""

import asyncio
import contextlib
import contextvars
from collections.abc import Awaitable, Callable
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import pytest
import viser

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Readback
from web_panel.access.client_message import ClientMessages
from web_panel.controls.control import Control
from web_panel.rig.answer import Answer
from web_panel.tuning.changes import Changes

TABLE = table_of(parse(shipped_text("roll"), "roll.toml"))
BROWSER, OTHER = 3, 4


class Slider:
    """viser's handle, as far as a control knows it. viser writes `value` before it calls anybody."""

    def __init__(self, value: float) -> None:
        self.value = value
        self._impl = SimpleNamespace(uuid="slider")
        self.moved: Callable[[Any], Awaitable[None]]

    def on_update(self, moved: Callable[[Any], Awaitable[None]]) -> None:
        self.moved = moved


class Gui:
    """Elements that a control makes on a page."""

    def __init__(self) -> None:
        self.slider = Slider(0.0)

    def add_html(self, content: str) -> Any:
        return SimpleNamespace(content=content, order=1.0)

    def add_slider(self, *words: Any, **more: Any) -> Slider:
        self.slider = Slider(words[4])
        return self.slider


class Bench:
    """One control, what it asked for, and a browser that moves it."""

    def __init__(self, name: str, scene_value: float) -> None:
        self.gui, self.messages = Gui(), ClientMessages()
        self.asked: list[tuple[str, float, int | None]] = []
        self.refused: list[tuple[str, float, str]] = []
        changes = SimpleNamespace(
            want_one=lambda *request: self.asked.append(request),
            refuse=lambda *request: self.refused.append(request),
        )
        self.control = Control(
            cast(viser.ViserServer, SimpleNamespace(gui=self.gui)),
            cast(viser.GuiFolderHandle, contextlib.nullcontext()),
            self.messages,
            cast(Changes, changes),
            TABLE[name],
            scene_value,
            large=True,
        )

    def browsers_move(self, *moves: tuple[int, float], meanwhile: Callable[[], None] = lambda: None) -> None:
        """As viser takes it: each browser has a task that reads, past the guard; each message one that is run later."""

        async def reading(client: int, position: float) -> None:
            updates = {"value": position}
            frame = {"type": "GuiUpdateMessage", "uuid": "slider", "updates": updates}
            assert self.messages.admits(msgspec.msgpack.encode(frame))
            event = SimpleNamespace(client=object(), client_id=client, target=self.gui.slider)
            messages.append(asyncio.create_task(handled(position, event)))

        async def handled(position: float, event: Any) -> None:
            self.gui.slider.value = position
            meanwhile()
            await self.gui.slider.moved(event)

        async def all_of_it() -> None:
            readers = {client: contextvars.copy_context() for client, _ in moves}
            for client, position in moves:
                await asyncio.create_task(reading(client, position), context=readers[client])
            await asyncio.gather(*messages)

        messages: list[asyncio.Task[None]] = []
        asyncio.run(all_of_it())

    def browser_moves(self, position: float, meanwhile: Callable[[], None] = lambda: None) -> None:
        self.browsers_move((BROWSER, position), meanwhile=meanwhile)


@pytest.fixture
def bench() -> Bench:
    return Bench("dv_pls", 0.2)


def test_what_is_asked_is_what_the_browser_sent_wherever_the_slider_stands_by_then(bench: Bench) -> None:
    def main_thread() -> None:
        for _ in range(2):
            bench.control.show(Readback(value=0.2, revision=1), None, 1)

    bench.browser_moves(0.35, meanwhile=main_thread)
    assert bench.gui.slider.value == 0.2
    assert bench.asked == [("dv_pls", 0.35, BROWSER)]


def test_a_slider_is_not_moved_back_before_what_it_asks_for_is_noted(bench: Bench) -> None:
    """Quick presses of an arrow key: each sets out from where the page shows the slider."""
    value = 0.2

    def main_thread() -> None:
        bench.control.show(Readback(value=value, revision=1), None, 1)

    for _ in range(3):
        position = bench.gui.slider.value + 0.01
        bench.browser_moves(position, meanwhile=main_thread)
        assert bench.gui.slider.value == position
        ((_, value, _),) = bench.asked
        bench.asked.clear()
        bench.control.note_answer(value, Answer())
        main_thread()
    assert value == pytest.approx(0.23)


def test_a_slider_whose_browser_has_gone_is_moved_back(bench: Bench) -> None:
    bench.gui.slider.value = 0.35  # viser has written it, and then calls nobody
    used = Readback(value=0.2, revision=1)
    bench.control.show(used, None, 1)
    bench.control.show(used, None, 1)
    assert bench.gui.slider.value == 0.2


def test_each_browser_is_taken_at_its_word_in_turn(bench: Bench) -> None:
    """All were read before any was handled: whoever looks at the newest value gives one browser another one's."""
    moves = [(BROWSER, 0.3), (OTHER, 0.4), (BROWSER, 0.35), (OTHER, 0.45)]
    bench.browsers_move(*moves)
    assert bench.asked == [("dv_pls", value, client) for client, value in moves]


def test_a_slider_stays_where_it_was_put_until_its_wish_is_answered(bench: Bench) -> None:
    used = Readback(value=0.2, revision=1)
    bench.browser_moves(0.35)
    bench.control.show(used, None, 1)
    assert bench.gui.slider.value == 0.35
    bench.control.note_answer(0.35, Answer(reason="too much", refused=True))
    for _ in range(2):  # it may have been noted while the first turn is under way
        bench.control.show(used, None, 1)
    assert bench.gui.slider.value == 0.2


@pytest.mark.parametrize(("position", "words"), [(-0.5, "0"), (1e9, "10"), (5.0, "off the slider")])
def test_a_position_off_the_slider_is_refused_in_words(bench: Bench, position: float, words: str) -> None:
    """Beyond the table's range, or within it and beyond the slider's travel: no browser of ours sends either."""
    bench.browser_moves(position)
    assert not bench.asked
    ((name, value, reason),) = bench.refused
    assert (name, value) == ("dv_pls", position)
    assert words in reason


def test_the_readback_moves_a_slider_and_asks_for_nothing(bench: Bench) -> None:
    bench.control.show(Readback(value=0.3, revision=2), None, 2)
    assert bench.gui.slider.value == 0.3
    event = SimpleNamespace(client=None, client_id=None, target=bench.gui.slider)
    asyncio.run(cast(Any, bench.gui.slider.moved(event)))
    assert not bench.asked
