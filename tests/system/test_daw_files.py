"""The ready files of docs/daw/files with a whole rig: they hear its strikes, set its servo, and panic."""

import json
import re
import socket
import subprocess
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import pytest
import zenoh
from osc_port import OscPort
from rig_process import DRUMSTICK, PATIENCE_S, Listener, Rig, ask, free_port, running, wait_for

from osc_bench import built
from patching import PD, headless, listening
from protocol import osc as wire
from protocol.messages import Readback, State, decode

FILES = Path(__file__).parents[2] / "docs" / "daw" / "files"
PARAM = re.compile(r"/drumstick/param/([\w.]+)(/norm)?")

# A second patch beside ours: it sends "NAME value" to any receiver of Pd, and prints what some of them get.
DRIVER = """#N canvas 0 0 600 300 12;
#X obj 10 10 netreceive -u {port};
#X obj 10 40 list;
#X obj 10 60 t a a;
#X obj 100 90 list split 1;
#X obj 10 90 list split 1;
#X obj 10 120 list trim;
#X obj 10 200 send;
#X obj 300 110 receive~ drum-voice;
#X obj 300 140 env~ 4096;
#X obj 300 170 print voice;
#X connect 0 0 1 0;
#X connect 1 0 2 0;
#X connect 2 1 3 0;
#X connect 3 0 6 1;
#X connect 2 0 4 0;
#X connect 4 1 5 0;
#X connect 5 0 6 0;
#X connect 7 0 8 0;
#X connect 8 0 9 0;
"""
PRINTED = (
    "seq",
    "x",
    "y",
    "speed",
    "level",
    "peak",
    "velocity",
    "state",
    "dv_pls-is",
    "k_coll-is",
    "refused",
)


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("haptic", "--scene", "roll") as started:
        yield started


@pytest.fixture(autouse=True)
def armed(rig: Rig, session: zenoh.Session) -> None:
    """Each test begins with a rig that plays the scene's own values."""
    ask(session, rig.keys.set_many, {"dv_pls": 0.2, "k_coll": 5000.0})
    wait_for("the scene's values", lambda: value(session, rig, "dv_pls") == 0.2)


def value(session: zenoh.Session, rig: Rig, name: str) -> float:
    """Values that the servo uses."""
    return decode(ask(session, rig.keys.param(name)), Readback).value


def ported(rig: Rig, name: str, folder: Path) -> Path:
    """A copy of a ready file with this rig's ports instead of the usual ones."""
    text = (FILES / name).read_text(encoding="utf-8")
    for usual, own in ((wire.DEFAULT_IN[1], rig.osc_in), (wire.DEFAULT_OUT[1], rig.osc_out)):
        assert str(usual) in text
        text = re.sub(rf"\b{usual}\b", str(own), text)
    copy = folder / name
    copy.write_text(text, encoding="utf-8")
    return copy


def panicked(rig: Rig, session: zenoh.Session) -> None:
    """Wait for the servo's panic, and arm it again."""
    states = Listener(session, rig.keys.state, State)
    wait_for("the servo's panic", lambda: states.got and states.got[-1].status == "panic")
    subprocess.run([*DRUMSTICK, "arm", "--rig", rig.name], check=True, timeout=PATIENCE_S)
    wait_for("force again", lambda: states.got[-1].status != "panic")


@contextmanager
def heard_beside(rig: Rig) -> Iterator[OscPort]:
    """A second listener, subscribed: what the program under test should have heard too."""
    with OscPort(sends_to=rig.osc_in) as beside:
        beside.send("/drumstick/subscribe", beside.port)
        yield beside
        beside.send("/drumstick/unsubscribe")


class PureData:
    """Words of the patch's boxes, by their names, and a way to touch them."""

    def __init__(self, lines: list[str], port: int) -> None:
        self.lines, self._port = lines, port

    def shown(self, name: str) -> list[str]:
        return [line.strip().partition(": ")[2] for line in list(self.lines) if line.startswith(f"{name}: ")]

    def last(self, name: str) -> float | None:
        found = self.shown(name)
        return float(found[-1]) if found else None

    def touch(self, name: str, what: object) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.sendto(f"drum-{name} {what};\n".encode(), ("127.0.0.1", self._port))


@pytest.mark.long
@pytest.mark.needs("pd")
def test_the_patch_of_pure_data(rig: Rig, session: zenoh.Session, tmp_path: Path) -> None:
    port = free_port()
    driver = DRIVER.format(port=port)
    boxes = driver.count("#X obj")
    for name in PRINTED:
        driver += f"#X obj 400 10 r drum-{name};\n#X obj 400 40 print {name};\n"
        driver += f"#X connect {boxes} 0 {boxes + 1} 0;\n"
        boxes += 2
    (tmp_path / "driver.pd").write_text(driver)
    patch = ported(rig, "drumstick.pd", tmp_path)
    command = [*PD, "-open", str(patch), "-open", str(tmp_path / "driver.pd")]
    with listening(command, headless(tmp_path)) as lines, heard_beside(rig) as beside:
        pd = PureData(lines, port)
        wait_for("the first readbacks", lambda: pd.last("dv_pls-is") and pd.last("k_coll-is") == 5000.0)
        assert pd.last("dv_pls-is") == pytest.approx(0.2)
        wait_for("strikes", lambda: len(pd.shown("peak")) > 5)
        sequence = [float(word) for word in pd.shown("seq")]
        assert sequence == [sequence[0] + i for i in range(len(sequence))]
        beside_it: list[list[object]] = []

        def of_both() -> list[object] | None:  # each may have lost some
            beside_it.append(beside.receive("/drumstick/strike"))
            shown = set(map(float, pd.shown("seq")))
            return next((strike for strike in beside_it if strike[0] in shown), None)

        heard = wait_for("a strike of both", of_both)
        assert isinstance(heard[4], float)
        # Its numbers are shown one after the other, and newer ones behind them.
        for name, number in zip(("x", "y", "speed", "level", "peak"), heard[1:], strict=True):
            wait_for(
                f"its {name}",
                lambda n=name, w=number: (
                    w in [pytest.approx(float(word), rel=1e-4, abs=1e-6) for word in pd.shown(n)]
                ),
            )
        wait_for(
            "its velocity",
            lambda: (
                1 + round(126 * heard[4])
                in [pytest.approx(float(word), abs=1) for word in pd.shown("velocity")]
            ),
        )
        wait_for("the state", lambda: pd.shown("state")[-1:] == ["symbol playing"])

        assert pd.last("voice") in (None, 0.0)
        pd.touch("sound", 1)
        wait_for("the voice", lambda: (pd.last("voice") or 0.0) > 60.0)  # dB, 100 is full scale
        for name, wanted in (("dv_pls", 0.3), ("k_coll", 6000.0)):
            pd.touch(name, wanted)
            wait_for(
                f"{name} at the servo", lambda n=name, w=wanted: value(session, rig, n) == pytest.approx(w)
            )
            wait_for("its readback", lambda n=name, w=wanted: pd.last(f"{n}-is") == pytest.approx(w))
        pd.touch("k_coll", -1)  # beyond the slider, which only the hand keeps within
        wait_for("a refusal", lambda: pd.shown("refused") == ["symbol /drumstick/param/k_coll"])

        pd.touch("panic", "bang")
        wait_for("the state", lambda: pd.shown("state")[-1:] == ["symbol panic"])
        wait_for("silence", lambda: pd.last("voice") == 0.0)
        panicked(rig, session)
        assert not [line for line in lines if "error" in line or "failed" in line or "create" in line], lines


# Loads the file as a person would evaluate it, says what it gets, and evaluates what the test sends to /do.
CONDUCTOR = """
OSCdef(\\do, {{ |message| ("did: " ++ message[1].asString.interpret).postln }}, '/do');
~changed = {{ |name, value| ("readback: " ++ name ++ " " ++ value).postln }};
{before}
"{file}".load;
"loaded".postln;
"""


class SuperCollider:
    """sclang with the file loaded; it evaluates what it is told."""

    def __init__(self, lines: list[str], port: int) -> None:
        self.lines, self._port = lines, port

    def said(self, name: str) -> list[str]:
        return [line.strip().partition(": ")[2] for line in list(self.lines) if line.startswith(f"{name}: ")]

    def readback(self, name: str) -> float | None:
        found = [line.split()[1] for line in self.said("readback") if line.startswith(f"{name} ")]
        return float(found[-1]) if found else None

    def do(self, words: str) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.sendto(built("/do", words), ("127.0.0.1", self._port))


@contextmanager
def conducted(rig: Rig, folder: Path, before: str, environment: dict[str, str]) -> Iterator[SuperCollider]:
    """The program with the file, when it listens."""
    port = free_port()
    script = folder / "conductor.scd"
    script.write_text(CONDUCTOR.format(before=before, file=ported(rig, "drumstick.scd", folder)))
    with listening(["sclang", "-u", str(port), "-D", str(script)], environment) as lines:
        sc = SuperCollider(lines, port)
        wait_for("the file", lambda: "loaded\n" in lines)
        yield sc


@pytest.mark.needs("sclang")
@pytest.mark.long
def test_the_script_of_supercollider(rig: Rig, session: zenoh.Session, tmp_path: Path) -> None:
    # Its sound is computed in tests/contract/test_daw_supercollider.py: no server has to keep time here.
    before = '~sound = false; ~struck = { |...strike| ("struck: " ++ strike.join($ )).postln };'
    with conducted(rig, tmp_path, before, headless(tmp_path)) as sc, heard_beside(rig) as beside:
        wait_for(
            "the readbacks",
            lambda: [sc.readback(n) for n in ("dv_pls", "k_coll")] == [pytest.approx(0.2), 5000.0],
        )
        wait_for("strikes", lambda: len(sc.said("struck")) > 5)
        beside_it: list[list[object]] = []

        def of_both() -> bool:  # each may have lost some
            beside_it.append(beside.receive("/drumstick/strike")[1:])
            shown = [[float(word) for word in line.split()] for line in sc.said("struck")]
            return any(
                one == pytest.approx(heard, rel=1e-4, abs=1e-6) for one in shown for heard in beside_it
            )

        wait_for("a strike of both", of_both)
        for name, wanted in (("dv_pls", 0.3), ("k_coll", 6000.0)):
            sc.do(f"~set.(\\{name}, {wanted})")
            wait_for(
                f"{name} at the servo", lambda n=name, w=wanted: value(session, rig, n) == pytest.approx(w)
            )
            wait_for("its readback", lambda n=name, w=wanted: sc.readback(n) == pytest.approx(w))
        sc.do("~set.(\\k_coll, 1e7)")
        wait_for("the refusal", lambda: any("refused: /drumstick/param/k_coll" in s for s in list(sc.lines)))
        sc.do("~panic.()")
        panicked(rig, session)
        assert not [line for line in sc.lines if "ERROR" in line], sc.lines


@pytest.mark.parametrize("surface", ["open stage control", "touchosc"])
@pytest.mark.long
def test_what_the_controls_of_a_touch_screen_send(
    surface: str, rig: Rig, session: zenoh.Session, osc: OscPort
) -> None:
    # Each has places of its own, which are none of the scene: what another one set, or what arming published, and comes
    # back within a second is an echo.
    travels, part = (open_stage_control(), 0.35) if surface == "open stage control" else (touchosc(), 0.65)
    assert len(travels) == 2
    for address, (low, high) in travels.items():
        name = PARAM.fullmatch(address)
        assert name is not None
        for end in (low, low + part * (high - low), high):
            osc.send(address, float(end))
            came, params = answered(osc, address, end)
            # What is too much together is for the envelope to say; no end is outside the table or of a wrong type.
            assert came == address or "limit is" in str(params[1]), (address, params)
        before = value(session, rig, name[1])
        between = low + 0.5 * part * (high - low)
        osc.send(address, float(between))
        assert answered(osc, address, between)[0] == address
        wait_for("it at the servo", lambda n=name[1], b=before: value(session, rig, n) != b)
    osc.send("/drumstick/panic", 1)
    panicked(rig, session)


def answered(osc: OscPort, address: str, value: float) -> tuple[str, list[object]]:
    """Its readback, or the refusal; readbacks of what was set before may come first."""
    while True:
        came, params = osc.next(address, "/drumstick/error")
        if came != address or params == [pytest.approx(value, rel=1e-5)]:
            return came, params


def open_stage_control() -> dict[str, tuple[float, float]]:
    """Address -> travel of each fader that may be touched, as the session has them."""
    content = json.loads((FILES / "drumstick-open-stage-control.json").read_text(encoding="utf-8"))["content"]
    touched = [w for w in content["widgets"] if w["type"] == "fader" and w.get("interaction", True)]
    assert {w["typeTags"] for w in touched} == {"f"}
    return {w["address"]: (w["range"]["min"], w["range"]["max"]) for w in touched}


def touchosc() -> dict[str, tuple[float, float]]:
    """The same of the layout, which sends the 0..1 form."""
    root = ElementTree.fromstring(zlib.decompress((FILES / "drumstick.tosc").read_bytes()))
    found: dict[str, tuple[float, float]] = {}
    for message in root.iterfind(".//node[@type='FADER']/messages/osc[send='1']"):
        ends = [float(str(message.findtext(f"arguments/partial/{end}"))) for end in ("scaleMin", "scaleMax")]
        found[str(message.findtext("path/partial/value"))] = (ends[0], ends[1])
    return found
