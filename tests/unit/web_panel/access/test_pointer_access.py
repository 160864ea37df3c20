"""Frames of a pad, read and thinned, and the pad's script, whole in the page."""

import html
import re
from importlib import resources

import pytest
from hypothesis import given
from hypothesis import strategies as st

from web_panel.access.pad_socket import frame_of
from web_panel.access.pointer_access import Pad, PointerFrame
from web_panel.page.pad import pad


def test_a_frame() -> None:
    assert frame_of(PointerFrame, "[true, 0.25, -0.5]") == PointerFrame(held=True, lift=0.25, x=-0.5)
    assert frame_of(PointerFrame, "[false,1,0]") == PointerFrame(held=False, lift=1.0, x=0.0)


@pytest.mark.parametrize(
    "text",
    [
        "", "null", "[]", "[true, 0.5]", "[true, 0.5, 0, 0]", "[1, 0.5, 0]", '[true, "0.5", 0]', "[true, 1.01, 0]",
        "[true, -0.01, 0]", "[true, 0, -1.5]", "[true, 1e999, 0]", "[true, NaN, 0]", "[true, Infinity, 0]",
        '{"held": true}', b"[true, 0.5, 0]", None, "[true, 0.5, 0" + " " * 300 + "]",
    ],
)  # fmt: skip
def test_what_is_no_frame(text: object) -> None:
    assert frame_of(PointerFrame, text) is None


@given(st.text() | st.binary())
def test_no_text_raises(text: str | bytes) -> None:
    frame = frame_of(PointerFrame, text)
    assert frame is None or 0.0 <= frame.lift <= 1.0


def test_pressing_and_letting_go_always_count_and_others_are_thinned() -> None:
    one = Pad()
    down, up = PointerFrame(held=True, lift=0.0, x=0.0), PointerFrame(held=False, lift=1.0, x=0.0)
    sent = [
        one.pointer(frame, at)
        for frame, at in ((up, 0.0), (down, 0.0), (down, 0.001), (down, 0.005), (up, 0.0051))
    ]
    assert [pointer.held if pointer else None for pointer in sent] == [None, True, None, True, False]
    assert [pointer.seq for pointer in sent if pointer] == [1, 2, 3]
    assert len({pointer.source for pointer in sent if pointer}) == 1
    other = Pad().pointer(down, 0.0)
    assert other is not None
    assert sent[1] is not None
    assert other.source != sent[1].source


def test_the_script_is_whole_inside_its_attribute() -> None:
    attribute = re.findall(r'onpointerenter="([^"]*)"', pad())
    assert [html.unescape(text) for text in attribute] == [
        (resources.files("web_panel.page") / "pad.js").read_text(encoding="utf-8")
    ]
    assert "<script" not in pad()
