"""A panic at any instant of a change of scene: whichever servo plays then is held, and none strikes before `arm`."""

import random
import time
from collections.abc import Iterator

import pytest
import zenoh
from osc_port import OscPort
from rig_process import Listener, Rig, running, wait_for
from settled import settled

from haptic_server import files
from protocol.messages import State, Strike
from rig.folder import run_folder
from rig.supervision.arm import arm

CHANGES = 50


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("haptic", "--scene", "roll") as started:
        yield started


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_a_panic_is_acted_on_at_every_instant_of_a_change(
    rig: Rig, session: zenoh.Session, osc: OscPort
) -> None:
    chance = random.Random(23)
    states = Listener(session, rig.keys.state, State)
    strikes = Listener(session, rig.keys.strike, Strike)
    wait_for("strikes and a state", lambda: strikes.got and states.got)
    changed = 0
    for change in range(CHANGES):
        boot = settled(rig, states).boot
        osc.send("/drumstick/scene/load", ("tom", "roll")[change % 2])
        if change % 5:  # about the handover, else while the next scene is made ready
            ready = run_folder(rig.name) / files.NEXT / files.SERVO_READY
            wait_for("the handover", lambda p=ready, b=boot: p.exists() or states.got[-1].boot != b, 180.0)
        time.sleep(chance.uniform(0.0, 0.3))
        osc.send("/drumstick/panic")
        # The servo that plays in the end is held from its first tick on, or since it saw the panic.
        wait_for("the panic", lambda: states.got[-1].status == "panic")
        held, seen, boots = states.got[-1], len(strikes.got), {boot}
        while True:  # the next servo may have had its turn already, and be held from its start on
            after = settled(rig, states)
            assert after.status == "panic", (change, after, rig.said)
            boots.add(after.boot)
            wait_for(
                "300 ticks more, or another servo",
                lambda s=after: states.got[-1].boot != s.boot or states.got[-1].ticks > s.ticks + 300,
            )
            if states.got[-1].boot == after.boot:
                break
        assert settled(rig, states).status == "panic"
        assert [s for s in strikes.got[seen:] if s.t_ns > held.t_ns] == []
        changed += len(boots) > 1
        arm(rig.name)
        # The state too: one of the panic, read after the next is asked for, would be taken for the answer to that.
        wait_for(
            "strikes again",
            lambda before=seen: len(strikes.got) > before and states.got[-1].status != "panic",
        )
    assert 0 < changed < CHANGES  # before and after the handover
