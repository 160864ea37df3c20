"""The question before a preset is deleted: how long it is asked. On a page of stand-ins, by a clock of the test's."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from types import SimpleNamespace
from typing import Any, cast

import viser

from web_panel.access.client_message import ClientMessages
from web_panel.controls.preset_panel import PresetActions, PresetPanel
from web_panel.rig.answer import Answer
from web_panel.rig.rig_state import RigState

BROWSER = 3


class Gui:
    """viser's, as far as the panel of presets knows it."""

    def __init__(self) -> None:
        self.buttons: dict[str, Any] = {}
        self.words: Any = None
        self._clicks: dict[str, Callable[[Any], Awaitable[None]]] = {}

    def add_folder(self, *_: Any, **__: Any) -> Any:
        return contextlib.nullcontext()

    def add_html(self, content: str, **_: Any) -> Any:
        self.words = SimpleNamespace(content=content)  # the last one is below the buttons
        return self.words

    def add_text(self, *_: Any, **__: Any) -> Any:
        return SimpleNamespace(value="", _impl=SimpleNamespace(uuid="name"))

    def add_button(self, label: str, **_: Any) -> Any:
        made = SimpleNamespace(label=label, disabled=True, _impl=SimpleNamespace(uuid=label))
        made.on_click = lambda click: self._clicks.__setitem__(label, click)
        self.buttons[label] = made
        return made

    def add_button_group(self, label: str, *_: Any, **__: Any) -> Any:
        return self.add_button(label)

    def click(self, label: str, value: str = "") -> None:
        event = SimpleNamespace(client_id=BROWSER, target=SimpleNamespace(value=value))
        asyncio.run(cast(Any, self._clicks[label](event)))


class Bench:
    """A panel that shows the preset `slow`, at `now` seconds, and what was deleted."""

    def __init__(self) -> None:
        self.gui, self.now, self.deleted = Gui(), 1000.0, []
        actions = PresetActions(*[cast(Any, None)] * 3, lambda name, _: self.deleted.append(name) or Answer())
        server = cast(viser.ViserServer, SimpleNamespace(gui=self.gui))
        self._panel = PresetPanel(server, ClientMessages(), actions, "main", 0.0)
        self._rig_state = RigState()
        self._rig_state.presets = ("slow",)
        self.show()
        self.gui.click("Preset", "slow")

    def show(self, after_s: float = 0.0) -> tuple[str, bool]:
        """Words below the buttons, and whether the preset can be deleted."""
        self.now += after_s
        self._panel.show(self._rig_state, self.now)
        return self.gui.words.content, not self.gui.buttons["Delete for good"].disabled


def test_a_question_that_nobody_answers_is_withdrawn_after_half_a_minute_and_says_so() -> None:
    bench = Bench()
    bench.gui.click("Delete preset")
    for after_s in (0.0, 20.0, 9.9):
        words, can_delete = bench.show(after_s)
        assert "Delete slow for good?" in words
        assert can_delete
    words, can_delete = bench.show(0.2)
    assert "slow: kept, as nothing was pressed for 30 s" in words
    assert "dr-alarm" in words  # so it is announced
    assert not can_delete
    assert bench.gui.buttons["Delete preset"].label == "Delete preset"
    bench.gui.click("Delete for good")  # by a page that does not know yet
    assert bench.deleted == []


def test_who_is_asked_again_has_half_a_minute_again() -> None:
    bench = Bench()
    bench.gui.click("Delete preset")
    bench.show()
    bench.show(20.0)
    bench.gui.click("Delete preset")  # keeps it
    assert "slow: kept" in bench.show()[0]
    bench.gui.click("Delete preset")
    assert bench.show(20.0)[1]
    assert bench.show(29.0)[1]
    bench.gui.click("Delete for good")
    assert bench.deleted == ["slow"]
    assert "slow: deleted" in bench.show(60.0)[0]
