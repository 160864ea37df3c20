"""Pure Data and SuperCollider's language, headless, against the front: they receive strikes and set a parameter."""

import time
from pathlib import Path

import pytest

from haptic_server.gateway.osc.osc_server import OscServer
from osc_bench import RELEASE, STRIKE, FakeParameters
from patching import PD, headless, listening
from ports import free_port

_PATIENCE_S = 200.0  # SuperCollider compiles its class library first

# netreceive -> oscparse -> print; and, every fifth of a second, 0.5 -> oscformat -> netsend.
PD_PATCH = """#N canvas 0 0 600 300 12;
#X obj 10 10 netreceive -u -b {heard_at};
#X obj 10 40 oscparse;
#X obj 10 70 print drumstick;
#X obj 200 10 loadbang;
#X msg 200 40 connect 127.0.0.1 {rig};
#X obj 200 160 netsend -u -b;
#X obj 350 40 metro 200;
#X msg 350 70 0.5;
#X obj 350 100 oscformat -f f drumstick param dv_pls;
#X obj 350 130 list prepend send;
#X obj 350 145 list trim;
#X connect 0 0 1 0;
#X connect 1 0 2 0;
#X connect 3 0 4 0;
#X connect 4 0 5 0;
#X connect 3 0 6 0;
#X connect 6 0 7 0;
#X connect 7 0 8 0;
#X connect 8 0 9 0;
#X connect 9 0 10 0;
#X connect 10 0 5 0;
"""

SC_SCRIPT = """
['/drumstick/strike', '/drumstick/release', '/drumstick/gate'].do {{ |address|
    OSCFunc({{ |message| ("drumstick:" + message.join($ )).postln }}, address);
}};
fork {{ loop {{ NetAddr("127.0.0.1", {rig}).sendMsg('/drumstick/param/dv_pls', 0.5); 0.2.wait }} }};
"""


def _pd(folder: Path, heard_at: int, rig: int) -> list[str]:
    patch = folder / "drumstick.pd"
    patch.write_text(PD_PATCH.format(heard_at=heard_at, rig=rig))
    return [*PD, "-open", str(patch)]


def _sclang(folder: Path, heard_at: int, rig: int) -> list[str]:
    script = folder / "drumstick.scd"
    script.write_text(SC_SCRIPT.format(rig=rig))
    return ["sclang", "-u", str(heard_at), "-D", str(script)]


@pytest.mark.parametrize(
    "program",
    [
        pytest.param(_pd, marks=pytest.mark.needs("pd"), id="pure data"),
        pytest.param(_sclang, marks=pytest.mark.needs("sclang"), id="supercollider"),
    ],
)
def test_strikes_are_heard_and_a_parameter_is_set(program, tmp_path: Path) -> None:
    parameters = FakeParameters()
    heard_at = free_port()
    front = OscServer(
        ("127.0.0.1", 0), [("127.0.0.1", heard_at)], "/drumstick", parameters, parameters.load_preset
    )
    try:
        with listening(program(tmp_path, heard_at, front.endpoint[1]), headless(tmp_path)) as lines:
            end = time.monotonic() + _PATIENCE_S
            wanted = ("strike 9 0.5 -0.25 1.5 0.75 12.5", "release 9 1.25 0.03125 13 0.0078125", "gate 0")

            def printed(words: str) -> bool:
                # Pd prints "drumstick: drumstick strike ...", SuperCollider an address and 13.0 for 13.
                return any(words in line.replace("/", " ").replace("13.0", "13") for line in list(lines))

            while not (parameters.sets and all(map(printed, wanted))):
                assert time.monotonic() < end, (parameters.sets, lines)
                front.strike(STRIKE)
                front.release(RELEASE)
                time.sleep(0.1)
        assert parameters.sets[0][0] == {"dv_pls": 0.5}
        assert front.counters.get("unreadable", 0) == 0
    finally:
        front.close()
