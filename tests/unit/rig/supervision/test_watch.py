"""Watching a rig over Zenoh, where anybody may publish anything."""

import json
import time

import zenoh

from ports import free_port
from protocol.keys import Keys
from protocol.messages import Meter, encode
from protocol.session import open_router
from rig.supervision.watch import Watch
from rig_messages import state

STATE = state(strikes=7)


def test_what_is_no_state_is_counted_and_ends_nothing() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    keys = Keys("watched")
    router: zenoh.Session = open_router(endpoint)
    watch = Watch(endpoint, keys)
    try:
        end = time.monotonic() + 30.0
        while watch.state is None or watch.unreadable < 3:
            assert time.monotonic() < end
            for payload in (b"", b"garbage", json.dumps([1, 2]).encode(), encode(STATE)):
                router.put(keys.state, payload)
            watch.poll()
            time.sleep(0.02)
        assert watch.strikes == 7
        for number in range(300):
            end = time.monotonic() + 30.0
            meter = Meter(
                id=f"made up {number}", t_ns=0, sink="null", peak_left=0.0, peak_right=0.0, load=0.0, xruns=1,
                latency_ms=0.0, played=0, late=0, duplicates=0,
            )  # fmt: skip
            while watch.meter is None or watch.meter.id != meter.id:
                assert time.monotonic() < end
                router.put(keys.meter, encode(meter))
                watch.poll()
        assert watch.xruns == 100  # one each of those that are remembered
    finally:
        watch.close()
        router.close()
