"""Chokes by OSC and by Zenoh while a whole rig is played: what rings ends, and the next strike is heard."""

import math
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import zenoh
from osc_port import OscPort
from rig_process import Listener, Rig, ask, wait_for
from wav_heard import heard_in, sound_in

from protocol.messages import Choke, Meter, decode

# The stick hangs above the head, so that only what is played by OSC sounds; it would ring for seconds.
SCENE = "[stick]\nz_ss_m = 0.05\n[drum]\nt60_s = 20.0\n"


@pytest.fixture(scope="module")
def rig(heard: Path) -> Iterator[Rig]:
    with heard_in(heard, SCENE) as started:
        yield started


@pytest.mark.long
def test_a_choke_by_osc_and_by_zenoh_ends_what_rings_and_the_next_strike_is_heard(
    rig: Rig, session: zenoh.Session, osc: OscPort, heard: Path
) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    chokes = Listener(session, rig.keys.choke, Choke)

    def is_silent() -> bool:
        sound = sound_in(heard)
        return len(sound) > 4800 and not np.any(sound[-4800:])

    def strike() -> None:
        """Strike until one is heard: one that a stall of the machine made late is not played."""
        known = meters.got[-1].played
        again = -math.inf

        def is_heard() -> bool:
            nonlocal again
            if meters.got[-1].played > known:
                return not is_silent()
            if time.monotonic() > again:
                osc.send("/drumstick/play/strike", 0.3, 0.1, 0.5)
                again = time.monotonic() + 1.0
            return False

        wait_for("a strike that is heard", is_heard)

    wait_for("a meter", lambda: meters.got and meters.got[-1].revision >= 0)
    strike()
    osc.send("/drumstick/play/choke")
    wait_for("silence", is_silent)
    strike()
    told = decode(ask(session, rig.keys.play_choke), Choke)
    wait_for("silence again", is_silent)
    strike()
    assert [choke.source.partition(" ")[0] for choke in chokes.got] == ["osc", "zenoh"]
    assert chokes.got[-1] == told
