"""The touch screens: a session of Open Stage Control (JSON), and a layout of TouchOSC (XML under zlib)."""

import json
import uuid
import xml.etree.ElementTree as ET
import zlib
from typing import Any

from drumstick_lab.pages.daw.daw_facts import Fader, faders, heard, sent
from protocol import osc

_RED, _GREEN, _GREY = (0.9, 0.1, 0.1), (0.2, 0.8, 0.4), (0.4, 0.4, 0.4)


# Open Stage Control


def _widget(kind: str, name: str, box: tuple[int, int, int, int], **more: Any) -> dict[str, Any]:
    left, top, width, height = box
    return {"type": kind, "id": name, "left": left, "top": top, "width": width, "height": height} | more


def _shown(kind: str, name: str, box: tuple[int, int, int, int], **more: Any) -> dict[str, Any]:
    """A widget that only shows: it takes no touch and sends nothing."""
    return _widget(kind, name, box, interaction=False, bypass=True, **more)


def _slider(fader: Fader, at: int) -> list[dict[str, Any]]:
    left = 20 + 130 * at
    ends = {"min": fader.travel.low, "max": fader.travel.high}
    slider = _widget(
        "fader",
        fader.name,
        (left, 20, 110, 320),
        range=ends,
        logScale=fader.travel.log,
        default=fader.start,
        address=fader.address,
        typeTags="f",
        decimals=4,
    )
    value = _shown("text", f"{fader.name}_now", (left, 345, 110, 50), address=fader.address)
    return [slider, value, _shown("text", f"{fader.name}_label", (left, 395, 110, 30), value=fader.label)]


def session() -> str:
    """The session of Open Stage Control."""
    strike = [
        _shown("text", "strike_x", (300, 345, 110, 50), address=sent(osc.X), decimals=2),
        _shown("text", "strike_y", (420, 345, 110, 50), address=sent(osc.Y), decimals=2),
        _shown(
            "xy",
            "strike_at",
            (300, 20, 320, 320),
            rangeX={"min": -1, "max": 1},
            rangeY={"min": -1, "max": 1},
            value="[@{strike_x}, @{strike_y}]",
        ),
        _shown("fader", "level", (640, 20, 60, 320), address=sent(osc.LEVEL), range={"min": 0, "max": 1}),
    ]
    state = [
        _shown("text", "state", (20, 440, 600, 40), address=sent(osc.ALIVE)),
        _shown("text", "refused", (20, 485, 600, 40), address=sent(osc.ERROR)),
    ]
    panic = _widget(
        "button",
        "panic",
        (640, 440, 160, 85),
        label="PANIC",
        mode="tap",
        on=1,
        address=heard(osc.PANIC),
        typeTags="i",
        colorWidget="#e01b24",
    )
    sliders = [widget for at, fader in enumerate(faders()) for widget in _slider(fader, at)]
    root = {
        "type": "root",
        "id": "root",
        "onCreate": f"send('{heard(osc.SYNC)}')",
        "widgets": [*sliders, *strike, *state, panic],
        "tabs": [],
    }
    whole = {"createdWith": "Open Stage Control", "version": "1.30.1", "type": "session", "content": root}
    return json.dumps(whole, indent=1) + "\n"


# TouchOSC


def _text(parent: ET.Element, tag: str, value: object) -> ET.Element:
    made = ET.SubElement(parent, tag)
    made.text = str(value)
    return made


def _property(parent: ET.Element, kind: str, key: str, value: object) -> None:
    made = ET.SubElement(parent, "property", type=kind)
    _text(made, "key", key)
    if kind in ("r", "c"):
        inner = ET.SubElement(made, "value")
        for tag, number in zip("xywh" if kind == "r" else "rgba", value, strict=True):  # type: ignore[call-overload]
            _text(inner, tag, f"{number:g}")
    else:
        _text(made, "value", value)


def _node(
    parent: ET.Element,
    kind: str,
    name: str,
    frame: tuple[int, int, int, int],
    colour: tuple[float, float, float],
    values: dict[str, str],
    touched: bool = False,
    **more: tuple[str, object],
) -> ET.Element:
    """A control; `values`: its values with their defaults. Its messages come after."""
    made = ET.SubElement(
        parent, "node", ID=str(uuid.uuid5(uuid.NAMESPACE_URL, f"haptic drumstick {name}")), type=kind
    )
    properties = ET.SubElement(made, "properties")
    _property(properties, "s", "name", name)
    _property(properties, "r", "frame", frame)
    _property(properties, "c", "color", (*colour, 1.0))
    for key in ("background", "visible", "outline"):
        _property(properties, "b", key, 1)
    _property(properties, "b", "interactive", int(touched))
    for key, (letter, value) in more.items():
        _property(properties, letter, key, value)
    held = ET.SubElement(made, "values")
    for key, default in {"touch": "false", **values}.items():
        value = ET.SubElement(held, "value")
        _text(value, "key", key)
        _text(value, "locked", 0)
        _text(value, "lockedDefaultCurrent", 0)
        _text(value, "default", default)
        _text(value, "defaultPull", 0)
    ET.SubElement(made, "messages")
    return made


def _partial(parent: ET.Element, kind: str, conversion: str, value: str, ends: tuple[float, float]) -> None:
    made = ET.SubElement(parent, "partial")
    _text(made, "type", kind)
    _text(made, "conversion", conversion)
    _text(made, "value", value)
    _text(made, "scaleMin", f"{ends[0]:g}")
    _text(made, "scaleMax", f"{ends[1]:g}")


def _message(
    node: ET.Element,
    address: str,
    arguments: list[tuple[str, str, str, tuple[float, float]]],
    sends: bool,
    trigger: tuple[str, str],
) -> None:
    """An OSC message of a control, to and from the first connection."""
    messages = node.find("messages")
    assert messages is not None
    made = ET.SubElement(messages, "osc")
    for tag, value in (
        ("enabled", 1),
        ("send", int(sends)),
        ("receive", 1),
        ("feedback", 0),
        ("connections", "00001"),
    ):
        _text(made, tag, value)
    one = ET.SubElement(ET.SubElement(made, "triggers"), "trigger")
    _text(one, "var", trigger[0])
    _text(one, "condition", trigger[1])
    _partial(ET.SubElement(made, "path"), "CONSTANT", "STRING", address, (0, 1))
    held = ET.SubElement(made, "arguments")
    for argument in arguments:
        _partial(held, *argument)


def _number(value: str, ends: tuple[float, float]) -> tuple[str, str, str, tuple[float, float]]:
    return ("VALUE", "FLOAT", value, ends)


_ONE = (0.0, 1.0)
_WORD = ("VALUE", "STRING", "text", _ONE)
_SKIPPED = ("CONSTANT", "STRING", "", _ONE)


def _touch_slider(parent: ET.Element, fader: Fader, at: int) -> None:
    left = 20 + 130 * at
    frame = (left, 20, 110, 400)
    slider = _node(parent, "FADER", fader.name, frame, _GREEN, {"x": "0"}, True)
    _message(slider, fader.norm_address, [_number("x", fader.norms)], True, ("x", "ANY"))
    label = _node(parent, "LABEL", f"{fader.name}_label", (left, 470, 110, 40), _GREY, {"text": fader.label})
    assert label is not None
    now = _node(parent, "LABEL", f"{fader.name}_now", (left, 425, 110, 40), _GREY, {"text": "-"})
    _message(now, fader.address, [_WORD], False, ("text", "ANY"))


def layout() -> str:
    """The layout of TouchOSC, as XML."""
    root = ET.Element("lexml", version="3")
    page = _node(root, "GROUP", "drumstick", (0, 0, 800, 640), (0.1, 0.1, 0.1), {})
    parent = ET.SubElement(page, "children")
    for at, fader in enumerate(faders()):
        _touch_slider(parent, fader, at)
    strike = _node(parent, "XY", "strike", (300, 20, 400, 400), _GREEN, {"x": "0.5", "y": "0.5"})
    _message(strike, sent(osc.X), [_number("x", (-1.0, 1.0))], False, ("x", "ANY"))
    _message(strike, sent(osc.Y), [_number("y", (-1.0, 1.0))], False, ("y", "ANY"))
    level = _node(parent, "FADER", "level", (720, 20, 60, 400), _GREEN, {"x": "0"})
    _message(level, sent(osc.LEVEL), [_number("x", _ONE)], False, ("x", "ANY"))
    state = _node(parent, "LABEL", "state", (20, 530, 500, 40), _GREY, {"text": "-"})
    _message(state, sent(osc.ALIVE), [_SKIPPED, _WORD], False, ("text", "ANY"))
    refused = _node(parent, "LABEL", "refused", (20, 580, 500, 40), _GREY, {"text": "-"})
    _message(refused, sent(osc.ERROR), [_SKIPPED, _WORD], False, ("text", "ANY"))
    panic = _node(parent, "BUTTON", "panic", (560, 470, 220, 150), _RED, {"x": "0"}, True)
    _message(panic, heard(osc.PANIC), [], True, ("x", "ANY"))
    sync = _node(parent, "BUTTON", "sync", (300, 430, 120, 80), _GREY, {"x": "0"}, True)
    _message(sync, heard(osc.SYNC), [], True, ("x", "RISE"))
    ET.indent(root, " ")
    return ET.tostring(root, encoding="unicode", xml_declaration=False) + "\n"


def packed() -> bytes:
    """The .tosc file."""
    return zlib.compress(b"<?xml version='1.0' encoding='UTF-8'?>\n" + layout().encode(), 9)


def unpacked(file: bytes) -> str:
    """The XML in a .tosc file, without its first line."""
    return zlib.decompress(file).decode().partition("\n")[2]
