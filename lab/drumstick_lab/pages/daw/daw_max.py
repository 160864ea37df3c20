"""drumstick.maxpat: a patcher of Max, as JSON."""

import json
from typing import Any

from drumstick_lab.pages.daw.daw_facts import (
    CHANNEL,
    HOST,
    NOTE,
    PORT_IN,
    PORT_OUT,
    Fader,
    faders,
    heard,
    sent,
)
from protocol import osc

_KINDS = (osc.STRIKE, osc.GATE, osc.ALIVE, osc.ERROR)
_SHOWN = ("seq", "x", "y", "speed", "level", "peak")


class Patcher:
    """Boxes by id, and the lines between them."""

    def __init__(self) -> None:
        self._boxes: list[dict[str, Any]] = []
        self._lines: list[dict[str, Any]] = []

    def box(self, x: int, y: int, inlets: int, outlets: int, kind: str = "newobj", **more: Any) -> str:
        """A box; its id."""
        name = f"obj-{len(self._boxes) + 1}"
        width = more.pop("width", 8.0 * max(len(more.get("text", "")), 6) + 10)
        box: dict[str, Any] = {"id": name, "maxclass": kind, "numinlets": inlets, "numoutlets": outlets}
        if outlets:
            box["outlettype"] = [""] * outlets
        box["patching_rect"] = [float(x), float(y), float(width), float(more.pop("height", 22.0))]
        self._boxes.append({"box": box | more})
        return name

    def obj(self, x: int, y: int, text: str, inlets: int, outlets: int) -> str:
        """An object."""
        return self.box(x, y, inlets, outlets, text=text)

    def msg(self, x: int, y: int, text: str) -> str:
        """A message box."""
        return self.box(x, y, 2, 1, "message", text=text)

    def number(self, x: int, y: int, label: str) -> str:
        """A number box under its name."""
        self.box(x, y - 20, 1, 0, "comment", text=label)
        return self.box(x, y, 1, 2, "flonum", width=70, parameter_enable=0)

    def wire(self, box: str, outlet: int, into: str, inlet: int = 0) -> None:
        """Connect an outlet to an inlet."""
        self._lines.append({"patchline": {"source": [box, outlet], "destination": [into, inlet]}})

    def file(self) -> str:
        """The whole file."""
        patcher = {
            "fileversion": 1,
            "appversion": {"major": 8, "minor": 0, "revision": 0, "architecture": "x64", "modernui": 1},
            "classnamespace": "box",
            "rect": [60.0, 80.0, 960.0, 640.0],
            "boxes": self._boxes,
            "lines": self._lines,
        }
        return json.dumps({"patcher": patcher}, indent=1) + "\n"


def _hear(patcher: Patcher, surface: tuple[Fader, ...]) -> str:
    receive = patcher.obj(20, 60, f"udpreceive {PORT_OUT}", 1, 1)
    addresses = [*(sent(row) for row in _KINDS), *(fader.address for fader in surface)]
    kinds = patcher.obj(20, 95, f"route {' '.join(addresses)}", 1 + len(addresses), 1 + len(addresses))
    patcher.wire(receive, 0, kinds)
    return kinds


def _strikes(patcher: Patcher, kinds: str) -> None:
    unpack = patcher.obj(20, 140, "unpack 0 0. 0. 0. 0. 0.", 1, 6)
    patcher.wire(kinds, 0, unpack)
    for at, name in enumerate(_SHOWN):
        patcher.wire(unpack, at, patcher.number(20 + 80 * at, 200, name))
    # Outlets fire from the right: the level is in makenote before the number of the strike strikes it.
    velocity = patcher.obj(20, 250, "expr 1+int($f1*126.+0.5)", 1, 1)
    patcher.wire(unpack, 4, velocity)
    struck = patcher.obj(20, 285, "t b", 1, 1)
    note = patcher.msg(20, 315, str(NOTE))
    made = patcher.obj(20, 350, "makenote 100 60", 3, 2)
    out = patcher.obj(20, 385, f"noteout {CHANNEL}", 3, 0)
    patcher.wire(unpack, 0, struck)
    patcher.wire(struck, 0, note)
    patcher.wire(note, 0, made, 0)
    patcher.wire(velocity, 0, made, 1)
    patcher.wire(made, 0, out, 0)
    patcher.wire(made, 1, out, 1)


def _states(patcher: Patcher, kinds: str) -> None:
    patcher.wire(kinds, 1, patcher.box(520, 200, 1, 1, "toggle", width=24, height=24.0, parameter_enable=0))
    for outlet, y, label in ((2, 430, "state"), (3, 490, "refused")):
        patcher.box(20, y - 20, 1, 0, "comment", text=label)
        shown = patcher.msg(20, y + 25, "")
        prepend = patcher.obj(20, y, "prepend set", 1, 1)
        patcher.wire(kinds, outlet, prepend)
        patcher.wire(prepend, 0, shown)


def _fader(patcher: Patcher, fader: Fader, at: int, kinds: str, send: str) -> None:
    """A slider of 0..1, its value in SI units, and the readback beside it."""
    x, low, high = 600, fader.travel.low, fader.travel.high
    y = 60 + 170 * at
    patcher.box(x, y - 22, 1, 0, "comment", text=fader.label)
    slider = patcher.box(
        x, y, 1, 1, "slider", width=220, floatoutput=1, size=1.0, orientation=1, parameter_enable=0
    )
    law = (
        f"expr {low:g}*pow({high / low:g}\\,$f1)" if fader.travel.log else f"expr {low:g}+{high - low:g}*$f1"
    )
    value = patcher.obj(x, y + 35, law, 1, 1)
    packet = patcher.obj(x, y + 70, f"prepend {fader.address}", 1, 1)
    patcher.wire(slider, 0, value)
    patcher.wire(value, 0, packet)
    patcher.wire(packet, 0, send)
    patcher.wire(kinds, len(_KINDS) + at, patcher.number(x, y + 120, "servo"))


def _send(patcher: Patcher) -> str:
    send = patcher.obj(600, 560, f"udpsend {HOST} {PORT_IN}", 1, 0)
    loaded = patcher.obj(600, 420, "loadbang", 1, 1)
    sync = patcher.msg(600, 450, heard(osc.SYNC))
    patcher.wire(loaded, 0, sync)
    patcher.wire(sync, 0, send)
    panic = patcher.msg(600, 490, heard(osc.PANIC))
    patcher.box(740, 490, 1, 0, "comment", text="PANIC: click it twice")
    patcher.wire(panic, 0, send)
    subscribe = patcher.msg(600, 525, f"{heard(osc.SUBSCRIBE)} {PORT_OUT}")
    every = patcher.obj(820, 450, "metro 20000", 2, 1)
    switch = patcher.box(820, 420, 1, 1, "toggle", width=24, height=24.0, parameter_enable=0)
    patcher.box(850, 422, 1, 0, "comment", text="second listener")
    patcher.wire(switch, 0, every)
    patcher.wire(every, 0, subscribe)
    patcher.wire(subscribe, 0, send)
    return send


def file() -> str:
    """The patcher."""
    patcher = Patcher()
    words = "Haptic drumstick. Made by drumstick lab daw-files; docs/daw/ableton-max.md tells how to use it."
    patcher.box(20, 15, 1, 0, "comment", text=words)
    surface = faders()
    kinds = _hear(patcher, surface)
    _strikes(patcher, kinds)
    _states(patcher, kinds)
    send = _send(patcher)
    for at, fader in enumerate(surface):
        _fader(patcher, fader, at, kinds, send)
    return patcher.file()
