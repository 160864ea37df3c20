"""Choice of views in a window that becomes wider: what the browser is told, in which order. On a page of stand-ins."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from types import SimpleNamespace
from typing import Any, cast

import viser

from web_panel.access.client_message import ClientMessages
from web_panel.page import markup
from web_panel.page.browser_window import DESK, WIDE
from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.views.plot_style import View
from web_panel.views.view_choice import Looking


class Html:
    """viser's piece of HTML; `told` gets each of its texts, and "" when it goes."""

    def __init__(self, told: list[str], content: str) -> None:
        self._told = told
        self.content = content

    @property
    def content(self) -> str:
        return self._content

    @content.setter
    def content(self, content: str) -> None:
        self._content = content
        self._told.append(content)

    def remove(self) -> None:
        self._told.append("")


def nothing(*_: Any) -> None:
    pass


class Gui:
    """viser's, as far as the choice knows it."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self._clicks: dict[str, Callable[[Any], Awaitable[None]]] = {}

    def add_html(self, content: str, **_: Any) -> Html:
        return Html(self.told, content)

    def add_button_group(self, label: str, *_: Any, **__: Any) -> Any:
        made = SimpleNamespace(_impl=SimpleNamespace(uuid=label), remove=nothing)
        made.on_click = lambda click: self._clicks.__setitem__(label, click)
        return made

    def add_panel(self) -> Any:
        tab = contextlib.nullcontext()
        return SimpleNamespace(add_tab=lambda _: tab, dock_left=nothing, set_width=nothing, remove=nothing)

    def click(self, label: str, value: str) -> None:
        event = SimpleNamespace(target=SimpleNamespace(value=value))
        asyncio.run(cast(Any, self._clicks[label](event)))


def a_view(*_: Any) -> View:
    return cast(View, SimpleNamespace(needs=frozenset(), plots=(), show=nothing, remove=nothing))


class Bench:
    """A browser that may look at roll or level; `told`: what its page was told."""

    def __init__(self) -> None:
        self.gui = Gui()
        self.told = self.gui.told
        client = cast(viser.ClientHandle, SimpleNamespace(gui=self.gui, camera=None))
        self._looking = Looking(client, ClientMessages(), {"Roll": a_view, "Level": a_view}, 1.0)

    def show(self) -> None:
        self._looking.show(RigState(), PlotHistory(), 0.0)

    def pressed(self, *presses: tuple[str, str]) -> set[str]:
        """The views that are shown after these presses, which all came between two looks of the panel's."""
        for group, button in presses:
            self.gui.click(group, button)
        self.show()
        (chosen,) = {text for text in self.told if text.startswith("<div data-chosen")} - {markup.chosen()}
        return {name for name in ("Roll", "Level") if name in chosen}


def test_a_window_is_told_to_be_wide_when_all_views_stand_in_it() -> None:
    bench = Bench()
    bench.gui.click("View", "Level")
    bench.show()
    title, wide = markup.line("Level", "view"), markup.room(WIDE)
    assert title in bench.told

    del bench.told[:]
    bench.gui.click("Room", WIDE)
    bench.show()
    assert bench.told.index("") < bench.told.index(title) < bench.told.index(wide)

    bench.gui.click("View", "Roll")
    bench.show()
    assert bench.told[-2:] == [markup.line("Roll", "view"), markup.chosen("Level", "Roll")]


def test_a_button_means_what_it_meant_where_it_was_pressed() -> None:
    bench = Bench()
    bench.show()
    del bench.told[:]
    assert bench.pressed(("View", "Roll"), ("Room", WIDE)) == {"Roll"}  # in a wide one it would take it away
    del bench.told[:]
    assert bench.pressed(("View", "Level")) == {"Roll", "Level"}
    del bench.told[:]
    assert bench.pressed(("View", "Roll"), ("Room", DESK)) == {"Level"}
