"""Frames of a strike pad, read and played, and the pad's script, whole in the page."""

import asyncio
import html
import math
import re
from importlib import resources
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosedOK

from web_panel.access.pad_socket import frame_of
from web_panel.access.strike_access import StrikeAccess, StrikeFrame
from web_panel.page.strike_pad import strike_pad


def test_a_frame() -> None:
    assert frame_of(StrikeFrame, "[0.25, -0.5, 1]") == StrikeFrame(0.25, -0.5, 1.0)


@pytest.mark.parametrize(
    "text",
    [
        "", "null", "[]", "[0, 0]", "[0, 0, 1, 1]", '["a", 0, 0, 1]', '["0", 0, 1]', "[0.9, 0.9, 1]",
        "[0, 0, 1.01]", "[0, 0, -1]", "[1e999, 0, 1]", "[NaN, 0, 1]", b"[0, 0, 1]", None, "[0, 0, 1]" + " " * 300,
    ],
)  # fmt: skip
def test_what_is_no_frame(text: object) -> None:
    assert frame_of(StrikeFrame, text) is None


@given(st.text() | st.binary())
def test_no_text_raises(text: str | bytes) -> None:
    frame = frame_of(StrikeFrame, text)
    assert frame is None or math.hypot(frame.x, frame.y) < 1.01


class Connection:
    """A websocket that brings these frames and then ends."""

    def __init__(self, *frames: str) -> None:
        self._frames = list(frames)
        self.sent: list[str] = []

    async def recv(self) -> str:
        if not self._frames:
            raise ConnectionClosedOK(None, None)
        return self._frames.pop(0)

    async def send(self, words: str) -> None:
        self.sent.append(words)


def test_each_frame_is_played_and_nothing_else() -> None:
    played: list[tuple[float, float, float]] = []
    chokes: list[object] = []
    access = StrikeAccess(lambda x, y, level, _refused: played.append((x, y, level)), chokes.append)
    asyncio.run(access.serve(cast(Any, Connection("[0, 0.5, 1]", "nonsense", "[0.25, 0, 0.5]"))))
    assert played == [(0.0, 0.5, 1.0), (0.25, 0.0, 0.5)]
    assert chokes == []


def test_a_level_of_0_chokes_and_strikes_nothing() -> None:
    chokes: list[object] = []
    access = StrikeAccess(lambda *_: pytest.fail("struck"), chokes.append)
    asyncio.run(access.serve(cast(Any, Connection("[0, 0.5, 0]"))))
    assert len(chokes) == 1


def test_a_refusal_comes_back_as_words() -> None:
    connection = Connection("[0, 0, 1]")

    async def visit() -> None:
        access = StrikeAccess(lambda *given: given[3]("Refused: why"), lambda refused: refused("no"))
        await access.serve(cast(Any, connection))
        while not connection.sent:
            await asyncio.sleep(0)

    asyncio.run(visit())
    assert connection.sent == ["Refused: why"]


def test_the_script_is_whole_inside_its_attribute() -> None:
    attribute = re.findall(r'onload="([^"]*)"', strike_pad())
    assert [html.unescape(text) for text in attribute] == [
        (resources.files("web_panel.page") / "strike_pad.js").read_text(encoding="utf-8")
    ]
    assert "<script" not in strike_pad()
