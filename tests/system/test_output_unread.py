"""A whole rig whose output nobody takes: it plays on, hears a panic at once, and ends as it should."""

import contextlib
import os
import signal
from collections.abc import Iterator

import pytest
from osc_port import OscPort
from rig_process import Listener, Rig, running, wait_for

from protocol.messages import State
from unread import fill, full_pipe

pytestmark = pytest.mark.system
GATEWAY = "haptic_server.gateway"


@contextlib.contextmanager
def standing(rig: Rig) -> Iterator[None]:
    """The supervisor stands still, as after Ctrl-Z, and the gateway's pipe into it is full."""
    rig.process.send_signal(signal.SIGSTOP)
    try:
        fd = os.open(f"/proc/{rig.children()[GATEWAY]}/fd/2", os.O_WRONLY)
        fill(fd)
        os.close(fd)
        yield
    finally:
        rig.process.send_signal(signal.SIGCONT)


def flood(osc: OscPort) -> None:
    """Two thousand messages that are refused, and the answer to one that is not: all of them were heard."""
    for number in range(2000):
        osc.send("/drumstick/nothing", number)
        if number % 50 == 0:  # no more than the port keeps
            osc.send("/drumstick/ping", number)
            osc.receive("/drumstick/pong", number)


@pytest.mark.long
def test_a_rig_whose_output_nobody_takes_hears_a_panic_and_plays_on() -> None:
    with full_pipe() as (reading, writing), running("haptic", stderr=writing) as rig:
        session = rig.client()
        states: Listener[State] = Listener(session, rig.keys.state, State)
        wait_for("strikes", lambda: states.got and states.got[-1].strikes > 5)
        with OscPort(rig.osc_out, rig.osc_in) as osc:
            with standing(rig):
                flood(osc)
                before = states.got[-1].strikes
                wait_for("more strikes", lambda: states.got[-1].strikes > before + 5)
                osc.send("/drumstick/panic")
                wait_for("the servo's panic", lambda: states.got[-1].status == "panic")
            os.close(reading)  # whoever read the terminal dies
            os.close(writing)
            flood(osc)
        # Killed, it is started again: the supervisor says so to nobody, and goes on.
        old = rig.children()[GATEWAY]
        os.kill(old, signal.SIGKILL)
        wait_for("another gateway", lambda: rig.children().get(GATEWAY, old) != old)
        count = len(states.got)
        wait_for("its states", lambda: len(states.got) > count + 5)
        assert states.got[-1].status.startswith(("panic", "fault"))  # a fault is a machine that stood still
        assert rig.process.poll() is None
        session.close()
        assert rig.stop(signal.SIGHUP) == 0  # what the kernel sends when the terminal itself goes away
