"""Another scene while the rig runs: one that the device cannot play gives way to the one before."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
import zenoh
from rig_process import Listener, Rig, ask, running, wait_for

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
def test_what_the_device_cannot_play_gives_way_to_the_scene_before(rig: Rig, session: zenoh.Session) -> None:
    states = Listener(session, rig.keys.state, State)
    wait_for("a tick", lambda: states.got and states.got[-1].ticks > 0)
    boot = states.got[-1].boot
    ask(session, rig.keys.scene_load, "roll")  # harder than such a device can render
    # A machine that stood still for more than 20 ms has latched a fault, and the scene stays.
    wait_for(
        "the scene's end", lambda: any(words in rig.said for words in ("cannot be played", "is latched"))
    )
    assert "roll cannot be played here: back to the one before" in rig.said, rig.said
    wait_for("the servo of the scene before", lambda: states.got[-1].boot != boot)
    assert rig.process.poll() is None
    assert json.loads(ask(session, rig.keys.scene))["name"] == "phantom"
    assert "outside the envelope" in rig.said
