"""drumstick.pd: vanilla objects of Pure Data only."""

from drumstick_lab.pages.daw.daw_facts import (
    CHANNEL,
    F01_HZ,
    HOST,
    NOTE,
    PORT_IN,
    PORT_OUT,
    PREFIX,
    Fader,
    faders,
)
from protocol import osc

_PARTS = PREFIX.strip("/").replace("/", " ")
_COLOURS = "-262144 -1 -1"  # numbers, which older versions read too
_SHOWN = ("seq", "x", "y", "speed", "level", "peak")
_ROUTED = (osc.STRIKE, osc.LEVEL, osc.X, osc.Y, osc.GATE, osc.ALIVE, osc.ERROR)
# Ratios of a membrane's modes (0,1), (1,1), (0,2), and how much of each a blow at radius $f1 with level $f2 excites.
_MODES = ((1.0, 700, "1-0.8*$f1*$f1"), (1.594, 450, "1.2*$f1"), (2.296, 250, "0.5*(1-$f1)"))


class Patch:
    """Lines of a patch file; each box gets the number that the connections need."""

    def __init__(self) -> None:
        self._boxes: list[str] = []
        self._wires: list[str] = []

    def _box(self, kind: str, x: int, y: int, text: str, columns: int = 0) -> int:
        escaped = text.replace("$", "\\$").replace(";", " \\;").replace(",", " \\, ")
        self._boxes.append(f"#X {kind} {x} {y} {escaped}{f', f {columns}' * bool(columns)};")
        return len(self._boxes) - 1

    def obj(self, x: int, y: int, text: str, *feeds: int, columns: int = 0) -> int:
        """An object; `feeds`: the boxes whose first outlet goes into its first inlet; its text breaks at `columns`."""
        number = self._box("obj", x, y, text, columns)
        for box in feeds:
            self.wire(box, 0, number, 0)
        return number

    def msg(self, x: int, y: int, text: str, *feeds: int) -> int:
        """A message box."""
        number = self._box("msg", x, y, text)
        for box in feeds:
            self.wire(box, 0, number, 0)
        return number

    def text(self, x: int, y: int, words: str) -> None:
        """A comment."""
        self._box("text", x, y, words)

    def number(self, x: int, y: int, name: str, label: str) -> int:
        """A number box that tells [r NAME] what it shows."""
        return self._box("floatatom", x, y, f"9 0 0 2 {label} - {name} 12")

    def symbol(self, x: int, y: int, name: str, label: str, width: int) -> int:
        """A symbol box that tells [r NAME] what it shows."""
        return self._box("symbolatom", x, y, f"{width} 0 0 1 {label} - {name} 12")

    def bang(self, x: int, y: int, size: int, name: str, label: str) -> int:
        """A button that [s NAME] presses too."""
        return self.obj(
            x, y, f"bng {size} 250 50 0 empty {name} {label} {size + 6} {size // 2} 0 12 {_COLOURS}"
        )

    def toggle(self, x: int, y: int, name: str, label: str) -> int:
        """A switch that [s NAME] sets too."""
        return self.obj(x, y, f"tgl 19 0 empty {name} {label} 25 9 0 12 {_COLOURS} 0 1")

    def slider(self, x: int, y: int, low: float, high: float, log: bool, name: str, label: str) -> int:
        """A horizontal slider that [s NAME] moves too."""
        ends = f"{low:g} {high:g} {int(log)}"
        return self.obj(x, y, f"hsl 220 19 {ends} 0 empty {name} {label} -2 -9 0 12 {_COLOURS} 0 1")

    def wire(self, box: int, outlet: int, into: int, inlet: int) -> None:
        """Connect an outlet to an inlet."""
        self._wires.append(f"#X connect {box} {outlet} {into} {inlet};")

    def file(self) -> str:
        """The whole file."""
        return "\n".join(["#N canvas 40 40 1000 780 12;", *self._boxes, *self._wires, ""])


def _label(fader: Fader) -> str:
    # A label with spaces would be several words of the line.
    return f"{fader.name}_[{fader.unit}]"


def _hear(patch: Patch) -> tuple[int, int]:
    """Boxes that receive by kind, and that of the parameters."""
    patch.text(20, 60, f"The rig's messages, port {PORT_OUT}:")
    receive = patch.obj(20, 80, f"netreceive -u -b {PORT_OUT}")
    trim = patch.obj(20, 130, "list trim", patch.obj(20, 105, "oscparse", receive))
    for depth, part in enumerate(_PARTS.split()):
        trim = patch.obj(20, 155 + depth, f"route {part}", trim)
    names = [row.path.strip("/") for row in _ROUTED]
    parameters, _ = osc.PARAM.path.strip("/").split("/")
    return patch.obj(20, 185, f"route {' '.join(names)} {parameters}", trim), len(names)


def _show_strikes(patch: Patch, kinds: int) -> int:
    unpack = patch.obj(20, 215, "unpack f f f f f f", kinds)
    for at, name in enumerate(_SHOWN):
        box = patch.number(20 + 75 * at, 260, f"drum-{name}", name)
        patch.wire(unpack, at, box, 0)
    for at, name in ((1, "level"), (2, "x"), (3, "y")):
        box = patch.number(20 + 75 * (at - 1), 310, f"drum-one-{name}", f"/{name}")
        patch.wire(kinds, at, box, 0)
    gate = patch.toggle(250, 305, "drum-gate-led", "gate")
    patch.wire(kinds, 4, gate, 0)
    alive = patch.obj(500, 270, "unpack s s f")
    patch.wire(kinds, 5, alive, 0)
    patch.wire(alive, 1, patch.symbol(500, 297, "drum-state", "state", 40), 0)
    error = patch.obj(500, 325, "unpack s s")
    patch.wire(kinds, 6, error, 0)
    patch.wire(error, 0, patch.symbol(500, 352, "drum-refused", "refused", 40), 0)
    patch.wire(error, 1, patch.symbol(500, 379, "drum-why", "why", 60), 0)
    return unpack


def _voice(patch: Patch, unpack: int) -> None:
    patch.text(20, 350, "The voice. unpack gives level, then y, then x: x sounds it.")
    radius = patch.obj(20, 375, "expr min(1,sqrt($f1*$f1+$f2*$f2))")
    patch.wire(unpack, 1, radius, 0)
    patch.wire(unpack, 2, radius, 1)
    total = patch.obj(20, 550, "*~ 0.3")
    for at, (ratio, ms, share) in enumerate(_MODES):
        x = 20 + 165 * at
        weight = patch.obj(x, 405, f"expr sqrt($f2*({share}))", radius, columns=20)
        patch.wire(unpack, 4, weight, 1)
        line = patch.obj(x, 470, "vline~", patch.msg(x, 445, f"$1 1,0 {ms} 1", weight))
        curve = patch.obj(x, 495, "*~", line)
        patch.wire(line, 0, curve, 1)
        tone = patch.obj(x, 520, "*~", curve)
        patch.wire(patch.obj(x + 70, 495, f"osc~ {F01_HZ * ratio:g}"), 0, tone, 1)
        patch.wire(tone, 0, total, 0)
    volume = patch.slider(20, 590, 0, 1, False, "drum-volume", "volume")
    patch.wire(patch.msg(330, 600, "0.7", patch.obj(330, 575, "loadbang")), 0, volume, 0)
    level = patch.obj(20, 635, "*~", total)
    patch.wire(patch.obj(60, 610, "line~", patch.msg(120, 610, "$1 20", volume)), 0, level, 1)
    limited = patch.obj(20, 660, "clip~ -1 1", level)
    dac = patch.obj(20, 720, "dac~", limited)
    patch.wire(limited, 0, dac, 1)
    patch.obj(100, 690, "send~ drum-voice", limited)
    patch.msg(330, 660, "; pd dsp $1", patch.toggle(330, 630, "drum-sound", "sound"))


def _midi(patch: Patch, unpack: int) -> None:
    patch.text(500, 560, f"MIDI to a drum sampler: note {NOTE}, channel {CHANNEL}")
    velocity = patch.obj(620, 585, "expr 1+int($f1*126+0.5)")
    patch.wire(unpack, 4, velocity, 0)
    patch.wire(velocity, 0, patch.number(620, 620, "drum-velocity", "velocity"), 0)
    struck = patch.obj(500, 595, "t b", unpack)
    note = patch.msg(500, 620, str(NOTE), struck)
    gate = patch.obj(500, 650, "spigot", note)
    patch.wire(patch.toggle(550, 620, "drum-midi", "MIDI"), 0, gate, 1)
    made = patch.obj(500, 680, "makenote 100 60", gate)
    patch.wire(velocity, 0, made, 1)
    out = patch.obj(500, 710, f"noteout {CHANNEL}", made)
    patch.wire(made, 1, out, 1)


def _fader(patch: Patch, fader: Fader, at: int, reads: int) -> None:
    """A slider that sets, its readback, and the slider moved by the readback unless somebody has just moved it."""
    x, y = 500 + 255 * (at % 2), 60
    slider = patch.slider(
        x, y, fader.travel.low, fader.travel.high, fader.travel.log, f"drum-{fader.name}", _label(fader)
    )
    moved = patch.obj(x, y + 25, "t f b b", slider)
    packet = patch.obj(x, y + 150, f"oscformat -f f {_PARTS} param {fader.name}", moved)
    patch.obj(x + 150, y + 175, "s drum-out", packet)
    value = patch.obj(x + 120, y + 25, "route float")
    patch.wire(reads, at, value, 0)
    patch.wire(value, 0, patch.number(x + 150, y + 60, f"drum-{fader.name}-is", "servo"), 0)
    patch.obj(x + 230, y + 25, "s drum-answered", value)
    last = patch.obj(x + 80, y + 75, "f", value)
    free = patch.obj(x + 80, y + 100, "spigot 1", last)
    patch.wire(patch.msg(x + 80, y + 125, "set $1", free), 0, slider, 0)
    shut = patch.msg(x + 200, y + 100, "0")
    patch.wire(moved, 2, shut, 0)
    patch.wire(shut, 0, free, 1)
    later = patch.obj(x, y + 50, "delay 700")
    patch.wire(moved, 1, later, 0)
    again = patch.obj(x, y + 75, "t b b", later)
    patch.wire(again, 0, last, 0)
    opened = patch.msg(x, y + 100, "1")
    patch.wire(again, 1, opened, 0)
    patch.wire(opened, 0, free, 1)


def _send(patch: Patch) -> None:
    patch.text(500, 430, f"To the rig, {HOST} port {PORT_IN}:")
    loaded = patch.obj(500, 455, "loadbang")
    connect = patch.msg(500, 480, f"connect {HOST} {PORT_IN}", loaded)
    send = patch.obj(500, 530, "netsend -u -b", connect)
    linked = patch.toggle(620, 525, "drum-link", "linked")
    patch.wire(send, 0, linked, 0)
    patch.wire(patch.obj(750, 530, "delay 1000", patch.obj(705, 530, "sel 0", linked)), 0, connect, 0)
    packets = patch.obj(700, 455, "list prepend send", patch.obj(700, 430, "r drum-out"))
    patch.wire(patch.obj(700, 480, "list trim", packets), 0, send, 0)
    out = patch.obj(850, 505, "s drum-out")
    # Once a second, until somebody answers.
    asking = patch.obj(850, 430, "metro 1000", patch.obj(850, 380, "delay 300", loaded))
    patch.wire(patch.msg(950, 405, "stop", patch.obj(950, 380, "r drum-answered")), 0, asking, 0)
    sync = patch.obj(850, 455, f"oscformat {_PARTS} sync", asking)
    patch.wire(sync, 0, out, 0)
    patch.wire(patch.bang(850, 405, 19, "drum-sync", "sync"), 0, sync, 0)
    every = patch.obj(850, 580, "metro 20000", patch.toggle(850, 550, "drum-subscribe", "subscribe"))
    own = patch.obj(850, 630, f"oscformat -f i {_PARTS} subscribe", patch.msg(850, 605, str(PORT_OUT), every))
    patch.wire(own, 0, out, 0)
    panic = patch.obj(850, 700, "t b b", patch.bang(850, 660, 34, "drum-panic", "PANIC"))
    both = patch.obj(850, 725, f"oscformat {_PARTS} panic", panic)
    patch.wire(panic, 1, both, 0)
    patch.wire(both, 0, out, 0)


def file() -> str:
    """The patch."""
    patch = Patch()
    patch.text(
        20,
        15,
        "Haptic drumstick. Made by drumstick lab daw-files; docs/daw/pure-data.md tells how to use it.",
    )
    kinds, parameters = _hear(patch)
    unpack = _show_strikes(patch, kinds)
    _voice(patch, unpack)
    _midi(patch, unpack)
    surface = faders()
    reads = patch.obj(250, 215, f"route {' '.join(fader.name for fader in surface)}")
    patch.wire(kinds, parameters, reads, 0)
    for at, fader in enumerate(surface):
        _fader(patch, fader, at, reads)
    _send(patch)
    return patch.file()
