"""Parts of the page that a visitor has in view, from the messages that tell of them."""

from typing import Any

from drumstick_lab.benchmarks.scenes.drawn import drawn_of


def _part(kind: str, container: str = "root", **props: Any) -> dict[str, Any]:
    return {"type": kind, "container_uuid": container, "props": props}


PARTS = {
    "panel": {"type": "GuiSetPanelWidthMessage", "width": 600.0},
    "roll": _part("GuiFolderMessage", visible=False),
    "rate words": _part("GuiHtmlMessage", "roll", content='<div data-param="rate">'),
    "rate": _part("GuiSliderMessage", "roll"),
    "m words": _part("GuiHtmlMessage", content=""),
    "m": _part("GuiSliderMessage", visible=True),
    "level": _part("GuiUplotMessage"),
}
NODES = {"/sun": "DirectionalLightMessage", "/stick": "FrameMessage", "/head": "MeshMessage"}


def test_what_is_in_no_view_is_not_drawn_until_it_is_shown() -> None:
    words = {"uuid": "m words", "updates": {"content": '<div data-param="m">'}}
    assert drawn_of(PARTS, [words], NODES) == (["m"], 1, 1, 1)
    shown = {"uuid": "roll", "updates": {"visible": True}}
    assert drawn_of(PARTS, [words, shown], NODES) == (["m", "rate"], 2, 1, 1)
    hidden = {"uuid": "level", "updates": {"visible": False}}
    assert drawn_of(PARTS, [words, shown, hidden], {}) == (["m", "rate"], 2, 0, 0)
