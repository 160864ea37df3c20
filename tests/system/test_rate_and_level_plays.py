"""Rate and level of a rig that rolls: by OSC, by Zenoh and by the command, heard in its strikes."""

import json
import math
import subprocess
from collections.abc import Iterator
from itertools import pairwise

import pytest
import zenoh
from osc_port import OscPort
from rig_process import DRUMSTICK, Listener, Rig, ask, reason_of, reply_to, running, wait_for

from protocol.messages import Readback, SetReply, State, Strike, decode

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("haptic") as started:
        yield started


def _played(strikes: Listener[Strike], rate_Hz: float, level: float) -> bool:
    """True when the last strikes have this rate and level, within 1 %."""
    last = strikes.got[-6:]
    times_s = [strike.t_ns * 1e-9 for strike in last]
    return (
        len(last) == 6
        and all(math.isclose(1.0 / (b - a), rate_Hz, rel_tol=0.01) for a, b in pairwise(times_s))
        and all(math.isclose(strike.level, level, rel_tol=0.01) for strike in last)
    )


def test_rate_and_level_by_osc_are_played(rig: Rig, session: zenoh.Session, osc: OscPort) -> None:
    strikes = Listener(session, rig.keys.strike, Strike)
    osc.send("/drumstick/play/level")
    (level,) = osc.receive("/drumstick/play/level")
    assert isinstance(level, float)
    osc.send("/drumstick/play/rate", 30.0)
    assert osc.receive("/drumstick/play/rate", 30.0)
    wait_for("the faster roll, as loud as before", lambda: _played(strikes, 30.0, level))
    osc.send("/drumstick/play/level", 0.5, 1.0)
    assert osc.receive("/drumstick/play/level", 0.5)
    wait_for("the louder roll, as fast as before", lambda: _played(strikes, 30.0, 0.5))


def test_what_cannot_be_met_is_an_error_with_the_nearest(osc: OscPort) -> None:
    osc.send("/drumstick/play/rate", 200.0)
    address, why = osc.receive("/drumstick/error", None)
    assert address == "/drumstick/play/rate"
    assert "nearest:" in str(why)
    osc.send("/drumstick/play/level", 0.5, -1.0)
    assert "ramp" in str(osc.receive("/drumstick/error", None)[1])


def test_by_zenoh_and_by_the_command(rig: Rig, session: zenoh.Session) -> None:
    strikes, states = Listener(session, rig.keys.strike, Strike), Listener(session, rig.keys.state, State)
    found = decode(ask(session, rig.keys.play_roll, {"rate": 20.0, "level": 0.3}), SetReply)
    assert set(found.values) == {"k_hand", "z_ss", "dv_pls"}
    wait_for("the roll", lambda: _played(strikes, 20.0, 0.3))
    assert decode(ask(session, rig.keys.play_rate), Readback).value == pytest.approx(20.0, rel=1e-3)
    wait_for("a state of it", lambda: states.got and states.got[-1].revision == found.revision)
    assert decode(ask(session, rig.keys.play_rate, [20.05, 3.0]), Readback).revision == found.revision
    assert "outside" in reason_of(reply_to(session, rig.keys.play_level, b"1.5"))
    said = subprocess.run(
        [*DRUMSTICK, "play", "--rig", rig.name, "--connect", rig.endpoint, "--json"],
        capture_output=True,
        check=True,
    )
    assert json.loads(said.stdout) == pytest.approx({"rate": 20.0, "level": 0.3}, rel=1e-3)


def test_seconds_without_a_rate_or_level_are_refused() -> None:
    said = subprocess.run([*DRUMSTICK, "play", "--seconds", "3"], capture_output=True, text=True, check=False)
    assert (said.returncode, said.stdout) == (2, "")
    assert "--rate" in said.stderr
