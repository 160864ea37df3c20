"""A router of its own is killed and comes back: telemetry too, and no strike is played twice or late."""

import time
from collections import Counter

import pytest
from lone_router import LoneRouter, lone_router
from rig_process import PATIENCE_S, Listener, Rig, assert_steady, running, stood_still_s, wait_for

from haptic_server.servo.stall_detector import StallDetector
from protocol.messages import Meter, State, Strike
from protocol.session import open_client

pytestmark = [pytest.mark.system, pytest.mark.real_clock]
_AWAY_S = 2.0


@pytest.mark.long
def test_everything_returns_and_nothing_sounds_twice_or_late() -> None:
    with lone_router() as router, running("up", "--scene", "roll", "--connect", router.endpoint) as rig:
        end = time.monotonic() + PATIENCE_S
        session = open_client(router.endpoint, lambda: time.monotonic() < end)
        assert session is not None
        states = Listener(session, rig.keys.state, State)
        strikes = Listener(session, rig.keys.strike, Strike)
        meters = Listener(session, rig.keys.meter, Meter)
        wait_for("sound", lambda: meters.got and meters.got[-1].played > 20)
        for _ in range(2):
            _cut(router, rig, states, strikes, meters)
        session.close()
        told = Counter((s.boot, s.seq) for s in strikes.got)
        assert max(told.values()) == 1
        last = meters.got[-1]
        assert last.duplicates == 0
        # What was made while there was no router came too late to be played, or never; nothing else was.
        made = strikes.got[-1].seq - strikes.got[0].seq + 1
        assert last.played + last.late <= made + 40
        assert rig.stop() == 0


def _cut(router: LoneRouter, rig: Rig, states: Listener, strikes: Listener, meters: Listener) -> None:
    before = states.got[-1]
    with StallDetector() as probes:
        router.kill()
        time.sleep(_AWAY_S)  # how long the router is away is the subject: nobody could tell of its end
        heard, played = len(states.got), meters.got[-1].played
        router.start()
        wait_for("telemetry", lambda: len(states.got) > heard + 3)
        wait_for("sound", lambda: meters.got[-1].played > played + 10)
    after = states.got[-1]
    assert after.boot == before.boot
    assert after.t_ns - before.t_ns > 0.9e9 * _AWAY_S
    assert_steady(before, after, stood_still_s(probes))  # the servo never noticed
    assert strikes.got[-1].seq > before.strikes
