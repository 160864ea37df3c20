"""Another scene while the rig runs: one that the device cannot play is refused, and the present one plays on."""

import json
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
import zenoh
from rig_process import Listener, Rig, ask, running, wait_for

from osc_bench import built
from protocol.messages import State


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    recorded = tmp_path / "still.csv"
    rows = [f"{0.001 * tick:.3f},0.02" for tick in range(2000)]
    recorded.write_text("\n".join(["t_s,z_m", *rows]) + "\n")
    with running("haptic", "--scene", "phantom", "--device", f"replay:{recorded}") as started:
        yield started


# Both of this test alone: a fault that a stall of the machine has latched must not be there when it is tried again.
@pytest.fixture
def session(rig: Rig) -> Iterator[zenoh.Session]:
    opened = rig.client()
    yield opened
    opened.close()


@pytest.mark.long
def test_what_the_device_cannot_play_is_refused_and_stops_nothing(rig: Rig, session: zenoh.Session) -> None:
    states = Listener(session, rig.keys.state, State)
    wait_for("a tick", lambda: states.got and states.got[-1].ticks > 0)
    boot = states.got[-1].boot
    ask(session, rig.keys.scene_load, "roll")  # harder than such a device can render
    # A machine that stood still for more than 20 ms has latched a fault, and the scene stays for that.
    wait_for("the verdict", lambda: any(words in rig.said for words in ("cannot be played", "is latched")))
    assert "roll cannot be played here: phantom plays on" in rig.said, rig.said
    assert "outside the envelope" in rig.said
    wait_for("the refusal on the wire", lambda: "phantom plays on" in states.got[-1].scene_refusal)
    assert {state.boot for state in states.got} == {boot}  # nothing stopped
    assert json.loads(ask(session, rig.keys.scene))["name"] == "phantom"


@pytest.mark.long
def test_next_pressed_twice_plays_the_scene_after_the_next(tmp_path: Path) -> None:
    (tmp_path / "evening.txt").write_text("roll\ntom\nphantom\n")
    with (
        running("haptic", "--set-list", str(tmp_path / "evening.txt")) as rig,
        rig.client() as session,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as osc,
    ):
        states = Listener(session, rig.keys.state, State)
        wait_for("a tick", lambda: states.got and states.got[-1].ticks > 0)
        boot = states.got[-1].boot
        for _ in range(2):
            osc.sendto(built("/drumstick/scene/next"), ("127.0.0.1", rig.osc_in))
        wait_for("another servo", lambda: states.got[-1].boot != boot)
        wait_for("its scene", lambda: json.loads(ask(session, rig.keys.scene))["name"] == "phantom")
        assert len({state.boot for state in states.got}) == 2  # none in between
